import itertools
import math

import pytest

from sim.contacts.course import Course, Recorded, Straight, Stroke, Wave, stay, stroke

DT_S = 1e-4


def steepest(piece):
    """Largest slope [1/s]."""
    times_s = [n * DT_S for n in range(round(piece.lasts_s / DT_S))]
    return max(abs(piece.at(t + DT_S) - piece.at(t)) / DT_S for t in times_s)


def test_a_stroke_that_nobody_hurries_rises_at_10_n_per_second_at_most():
    assert steepest(stroke(0.0, 3.0)) == pytest.approx(10.0, rel=1e-3)
    assert steepest(stroke(3.0, 0.0)) == pytest.approx(10.0, rel=1e-3)


def test_a_stroke_that_is_hurried_takes_the_time_that_it_is_given():
    fast = stroke(0.0, 3.0, 0.05)
    assert fast.lasts_s == 0.05
    assert (fast.at(0.0), fast.at(0.05)) == (0.0, pytest.approx(3.0))
    assert steepest(fast) > 50


def test_a_stroke_begins_and_ends_without_a_jolt():
    slow = Stroke(0.5, 2.0, 1.0)
    assert slow.at(DT_S) - slow.at(0.0) < 1e-6
    assert slow.at(1.0) - slow.at(1.0 - DT_S) < 1e-6


def test_a_course_goes_through_its_pieces_and_stays_at_its_end():
    course = Course.of(Straight(0.0, 2.0, 1.0), stay(2.0, 0.5), Straight(2.0, 1.0, 1.0))
    assert course.lasts_s == 2.5
    told = [course.at(t_s) for t_s in (0.0, 0.5, 1.0, 1.25, 1.5, 2.0, 2.5, 99.0)]
    assert told == pytest.approx([0.0, 1.0, 2.0, 2.0, 2.0, 1.5, 1.0, 1.0])


def test_a_piece_that_takes_no_time_is_left_out():
    assert Course.of(Straight(0.0, 2.0, 1.0), stay(2.0, 0.0)).at(1.0) == 2.0


def test_a_wave_turns_as_often_as_its_frequency_says_and_keeps_within_its_amplitude():
    wave = Wave(2.0, 0.5, 10.0, 10.0, 4.0)
    values = [wave.at(n * DT_S) for n in range(40_001)]
    assert sum(a < 2.0 <= b for a, b in itertools.pairwise(values)) == pytest.approx(40, abs=1)
    assert max(values) == pytest.approx(2.5, abs=1e-3)
    assert min(values) == pytest.approx(1.5, abs=1e-3)
    assert (values[0], values[-1]) == (2.0, pytest.approx(2.0))


def test_a_chirp_goes_evenly_from_its_first_frequency_to_its_last():
    chirp = Wave(0.0, 1.0, 1.0, 5.0, 10.0)
    values = [chirp.at(n * DT_S) for n in range(100_001)]
    crossings_s = [n * DT_S for n in range(1, 100_001) if values[n - 1] < 0 <= values[n]]
    for t_s, next_s in itertools.pairwise(crossings_s):
        assert 1 / (next_s - t_s) == pytest.approx(1.0 + 0.4 * (t_s + next_s) / 2, rel=0.02)


def test_a_recorded_course_goes_straight_from_point_to_point():
    recorded = Recorded((0.0, 1.0, 1.5), (0.0, 2.0, 1.0))
    assert [recorded.at(t_s) for t_s in (0.0, 0.25, 1.0, 1.25, 1.5)] == pytest.approx([0, 0.5, 2, 1.5, 1])
    assert recorded.lasts_s == 1.5
    assert not any(math.isnan(recorded.at(n * 0.01)) for n in range(151))
