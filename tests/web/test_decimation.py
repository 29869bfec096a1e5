"""Tests of the decimation of live samples: few points remain, and no extreme is lost."""

import math
import random

import pytest

from pneuforce.web.decimation import MAX_BUCKET_SAMPLES, LiveDecimator, LivePoint

NAN = math.nan


def point(t_s, force_n=0.0, pressure_kpa=8.0):
    return LivePoint(t_s, force_n, 0.1, 1.2, pressure_kpa, 8.0, False, 4)


def decimated(points):
    decimator = LiveDecimator()
    return [kept for each in points for kept in decimator.add(each)]


def noise(seconds, rate_hz=500):
    rng = random.Random(1)
    return [point(i / rate_hz, rng.gauss(0, 1), rng.gauss(8, 1)) for i in range(seconds * rate_hz)]


def test_500_samples_per_second_become_at_most_100_points_per_second():
    kept = decimated(noise(10))
    assert 500 < len(kept) <= 1000
    assert [p.t_s for p in kept] == sorted({p.t_s for p in kept})


def test_samples_at_a_low_rate_are_unchanged():
    points = noise(2, rate_hz=50)
    assert decimated(points) == points[: len(decimated(points))]
    assert len(decimated(points)) >= 98


@pytest.mark.parametrize(
    "spike", [{"force_n": 9}, {"force_n": -9}, {"pressure_kpa": 17}, {"pressure_kpa": 0}]
)
def test_a_spike_of_one_sample_is_kept(spike):
    for index in range(100, 130):
        points = noise(1)
        points[index] = points[index]._replace(**spike)
        assert points[index] in decimated(points), index


def test_a_bucket_without_valid_values_keeps_one_point():
    kept = decimated([point(i / 500, NAN, NAN) for i in range(500)])
    assert 24 <= len(kept) <= 25
    assert all(math.isnan(p.force_n) for p in kept)


def test_a_missing_force_does_not_hide_an_extreme_of_the_pressure():
    points = [p._replace(force_n=NAN if i % 2 else p.force_n) for i, p in enumerate(noise(1))]
    highest = max(points[:400], key=lambda p: p.pressure_kpa)
    assert highest in decimated(points)


@pytest.mark.parametrize("t_s", [5.0, NAN, math.inf])
def test_a_stopped_clock_does_not_fill_the_memory(t_s):
    decimator = LiveDecimator()
    kept = [p for _ in range(10 * MAX_BUCKET_SAMPLES) for p in decimator.add(point(t_s))]
    assert 9 <= len(kept) <= 11
