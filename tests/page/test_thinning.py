"""So many less samples that a browser keeps up, and no extreme lost."""

import math
import random

import pytest

from page.thinning import MOST_OF_BUCKET, Point, Thinning

NAN = math.nan


def point(t_s, force_n=0.0, pressure_kpa=8.0):
    return Point(t_s, force_n, 0.1, pressure_kpa, 8.0, False)


def thinned(points):
    thinning = Thinning()
    return [shown for each in points for shown in thinning.take(each)]


def noise(seconds, rate_hz=500):
    chance = random.Random(1)
    return [point(i / rate_hz, chance.gauss(0, 1), chance.gauss(8, 1)) for i in range(seconds * rate_hz)]


def test_noise_of_500_samples_a_second_is_at_most_100_points_a_second():
    shown = thinned(noise(10))
    assert 500 < len(shown) <= 1000
    assert [p.t_s for p in shown] == sorted({p.t_s for p in shown})


def test_what_comes_slower_is_shown_as_it_came():
    points = noise(2, rate_hz=50)
    assert thinned(points) == points[: len(thinned(points))]
    assert len(thinned(points)) >= 98


@pytest.mark.parametrize(
    "spike", [{"force_n": 9}, {"force_n": -9}, {"pressure_kpa": 17}, {"pressure_kpa": 0}]
)
def test_a_spike_of_one_sample_is_seen_wherever_it_comes(spike):
    for at in range(100, 130):
        points = noise(1)
        points[at] = points[at]._replace(**spike)
        assert points[at] in thinned(points), at


def test_not_available_is_shown_where_there_is_nothing_else():
    shown = thinned([point(i / 500, NAN, NAN) for i in range(500)])
    assert 24 <= len(shown) <= 25
    assert all(math.isnan(p.force_n) for p in shown)


def test_no_force_hides_no_extreme_of_the_pressure():
    points = [p._replace(force_n=NAN if i % 2 else p.force_n) for i, p in enumerate(noise(1))]
    highest = max(points[:400], key=lambda p: p.pressure_kpa)
    assert highest in thinned(points)


@pytest.mark.parametrize("t_s", [5.0, NAN, math.inf])
def test_a_clock_that_stands_still_fills_no_memory(t_s):
    thinning = Thinning()
    shown = [p for _ in range(10 * MOST_OF_BUCKET) for p in thinning.take(point(t_s))]
    assert 9 <= len(shown) <= 11
