"""Tests of the decimation: a limited number of points keeps the extremes and the gaps of a curve."""

import math
import random

import numpy as np
import pytest

from pneuforce.instrument.recording.decimation import MinMaxDecimator

BUCKETS = 50


def decimate(values):
    decimator = MinMaxDecimator(BUCKETS)
    for number, value in enumerate(values):
        decimator.add(0.5 * number, value, number)
    return decimator


def test_a_short_curve_keeps_all_points():
    points = decimate([3.0, 1.0, 2.0]).points()
    assert points.tolist() == [[0.0, 3.0, 0.0], [0.5, 1.0, 1.0], [1.0, 2.0, 2.0]]
    assert not decimate([3.0, 1.0, 2.0]).decimated


@pytest.mark.parametrize("count", [100, 101, 999, 40_000])
def test_a_long_curve_keeps_each_peak_in_few_points(count):
    chance = random.Random(count)
    values = [math.sin(n / 900) + chance.gauss(0, 0.01) for n in range(count)]
    for n in chance.sample(range(count), 3):
        values[n] = chance.choice([-9.0, 9.0])
    decimator = decimate(values)
    points = decimator.points()
    assert len(points) <= 4 * BUCKETS + 2
    assert decimator.decimated
    seen = {(t_s, value) for t_s, value, _ in points.tolist()}
    spikes = {(0.5 * n, value) for n, value in enumerate(values) if abs(value) == 9.0}
    assert spikes <= seen
    assert (np.diff(points[:, 0]) > 0).all()
    assert all(values[int(2 * t_s)] == value and std == 2 * t_s for t_s, value, std in points.tolist())


@pytest.mark.parametrize("known", [0.5, 0.02])
def test_a_peak_between_values_that_are_not_available_is_kept(known):
    chance = random.Random(7)
    values = [chance.gauss(0, 0.01) if chance.random() < known else math.nan for _ in range(40_000)]
    for n, spike in zip(chance.sample(range(len(values)), 6), [-9.0, 9.0] * 3, strict=True):
        values[n - 1 : n + 2] = [math.nan, spike, math.nan]
    seen = {(t_s, value) for t_s, value, _ in decimate(values).points().tolist()}
    assert {(0.5 * n, value) for n, value in enumerate(values) if abs(value) == 9.0} <= seen


def test_nan_interrupts_the_curve():
    points = decimate([1.0, math.nan, math.nan, 2.0, 3.0]).points()
    assert [value != value for value in points[:, 1]] == [False, True, True, False, False]


def test_a_long_interruption_of_a_long_curve_stays_one_interruption():
    points = decimate([1.0] * 4000 + [math.nan] * 4000 + [2.0] * 4000).points()
    where = np.flatnonzero(np.isnan(points[:, 1]))
    assert 10 < len(where) < BUCKETS
    assert (np.diff(where) == 1).all()
    assert (points[: where[0], 1] == 1.0).all()
    assert (points[where[-1] + 1 :, 1] == 2.0).all()
