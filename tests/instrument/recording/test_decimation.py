"""A curve in few points: its extremes, its gaps, and how many points it keeps."""

import math
import random

import numpy as np
import pytest

from instrument.tape.strand import Strand

BUCKETS = 50


def strand_of(values, buckets=BUCKETS):
    strand = Strand(buckets)
    for number, value in enumerate(values):
        strand.take(0.5 * number, value, number)
    return strand


def test_a_short_curve_is_kept_as_it_is():
    points = strand_of([3.0, 1.0, 2.0]).points()
    assert points.tolist() == [[0.0, 3.0, 0.0], [0.5, 1.0, 1.0], [1.0, 2.0, 2.0]]
    assert not strand_of([3.0, 1.0, 2.0]).thinned


@pytest.mark.parametrize("count", [100, 101, 999, 40_000])
def test_a_long_one_keeps_each_peak_in_few_points(count):
    chance = random.Random(count)
    values = [math.sin(n / 900) + chance.gauss(0, 0.01) for n in range(count)]
    for n in chance.sample(range(count), 3):
        values[n] = chance.choice([-9.0, 9.0])
    strand = strand_of(values)
    points = strand.points()
    assert len(points) <= 4 * BUCKETS + 2
    assert strand.thinned
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
    seen = {(t_s, value) for t_s, value, _ in strand_of(values).points().tolist()}
    assert {(0.5 * n, value) for n, value in enumerate(values) if abs(value) == 9.0} <= seen


def test_what_is_not_a_number_interrupts_it():
    points = strand_of([1.0, math.nan, math.nan, 2.0, 3.0]).points()
    assert [value != value for value in points[:, 1]] == [False, True, True, False, False]


def test_a_long_interruption_is_one_however_long_the_curve():
    points = strand_of([1.0] * 4000 + [math.nan] * 4000 + [2.0] * 4000).points()
    where = np.flatnonzero(np.isnan(points[:, 1]))
    assert 10 < len(where) < BUCKETS
    assert (np.diff(where) == 1).all()
    assert (points[: where[0], 1] == 1.0).all()
    assert (points[where[-1] + 1 :, 1] == 2.0).all()
