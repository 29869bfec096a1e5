import itertools
import math

import pytest

from pneuforce.sim.contacts.trajectory import (
    LinearChange,
    Oscillation,
    Polyline,
    SmoothChange,
    Trajectory,
    constant,
    smooth_change,
)

DT_S = 1e-4


def max_slope(segment):
    """Return the largest slope of a segment [1/s]."""
    times_s = [n * DT_S for n in range(round(segment.duration_s / DT_S))]
    return max(abs(segment.at(t + DT_S) - segment.at(t)) / DT_S for t in times_s)


def test_a_smooth_change_has_a_slope_of_at_most_10_n_per_second_by_default():
    assert max_slope(smooth_change(0.0, 3.0)) == pytest.approx(10.0, rel=1e-3)
    assert max_slope(smooth_change(3.0, 0.0)) == pytest.approx(10.0, rel=1e-3)


def test_a_smooth_change_takes_the_given_time():
    fast = smooth_change(0.0, 3.0, 0.05)
    assert fast.duration_s == 0.05
    assert (fast.at(0.0), fast.at(0.05)) == (0.0, pytest.approx(3.0))
    assert max_slope(fast) > 50


def test_a_smooth_change_starts_and_ends_with_zero_slope():
    slow = SmoothChange(0.5, 2.0, 1.0)
    assert slow.at(DT_S) - slow.at(0.0) < 1e-6
    assert slow.at(1.0) - slow.at(1.0 - DT_S) < 1e-6


def test_a_trajectory_passes_its_segments_and_stays_at_the_end_value():
    trajectory = Trajectory.of(LinearChange(0.0, 2.0, 1.0), constant(2.0, 0.5), LinearChange(2.0, 1.0, 1.0))
    assert trajectory.duration_s == 2.5
    values = [trajectory.at(t_s) for t_s in (0.0, 0.5, 1.0, 1.25, 1.5, 2.0, 2.5, 99.0)]
    assert values == pytest.approx([0.0, 1.0, 2.0, 2.0, 2.0, 1.5, 1.0, 1.0])


def test_a_segment_without_duration_is_omitted():
    assert Trajectory.of(LinearChange(0.0, 2.0, 1.0), constant(2.0, 0.0)).at(1.0) == 2.0


def test_an_oscillation_has_its_frequency_and_stays_within_its_amplitude():
    oscillation = Oscillation(2.0, 0.5, 10.0, 10.0, 4.0)
    values = [oscillation.at(n * DT_S) for n in range(40_001)]
    assert sum(a < 2.0 <= b for a, b in itertools.pairwise(values)) == pytest.approx(40, abs=1)
    assert max(values) == pytest.approx(2.5, abs=1e-3)
    assert min(values) == pytest.approx(1.5, abs=1e-3)
    assert (values[0], values[-1]) == (2.0, pytest.approx(2.0))


def test_the_frequency_of_a_chirp_changes_linearly():
    chirp = Oscillation(0.0, 1.0, 1.0, 5.0, 10.0)
    values = [chirp.at(n * DT_S) for n in range(100_001)]
    crossings_s = [n * DT_S for n in range(1, 100_001) if values[n - 1] < 0 <= values[n]]
    for t_s, next_s in itertools.pairwise(crossings_s):
        assert 1 / (next_s - t_s) == pytest.approx(1.0 + 0.4 * (t_s + next_s) / 2, rel=0.02)


def test_a_polyline_is_linear_between_its_points():
    polyline = Polyline((0.0, 1.0, 1.5), (0.0, 2.0, 1.0))
    assert [polyline.at(t_s) for t_s in (0.0, 0.25, 1.0, 1.25, 1.5)] == pytest.approx([0, 0.5, 2, 1.5, 1])
    assert polyline.duration_s == 1.5
    assert not any(math.isnan(polyline.at(n * 0.01)) for n in range(151))
