"""The board's clock on the host's: quartz errors, late readers, wraps and restarts, in made-up time."""

import math
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from instrument.rig.clock import WRAP_US, BoardClock

LEAST_DELAY_S = 0.001
rates = st.floats(0.995, 1.005)
jitters = st.lists(st.floats(0.0, 0.02), min_size=20, max_size=60).map(lambda found: [*found, 0.0])
stalls = st.lists(st.tuples(st.floats(0.0, 20.0), st.floats(0.0, 1.0)), max_size=4)
starts = st.sampled_from([0, 1, WRAP_US - 3_000_000, WRAP_US // 2 - 1]) | st.integers(0, WRAP_US - 1)


class Story:
    """What a board sent, when, and when it was read."""

    def __init__(self, rate=1.0, jitter=(0.0,), stalls=(), start_us=0, lasts_s=20.0):
        self.taken_s = [100.0 + 0.002 * n for n in range(round(lasts_s / 0.002))]
        self.board_us = [(start_us + round((t - 100.0) * rate * 1e6)) % WRAP_US for t in self.taken_s]
        self.received_s = []
        for n, taken_s in enumerate(self.taken_s):
            arrives_s = taken_s + LEAST_DELAY_S + jitter[n % len(jitter)]
            for begins_s, lasts in stalls:  # nothing is read while the reader stands still
                if begins_s <= arrives_s - 100.0 < begins_s + lasts:
                    arrives_s = 100.0 + begins_s + lasts
            self.received_s.append(max(arrives_s, self.received_s[-1] if n else arrives_s))

    def told(self, clock):
        return [clock.taken_s(*reading) for reading in zip(self.board_us, self.received_s, strict=True)]


class TestAlways:
    """Whatever the delays are."""

    @settings(max_examples=25, deadline=None)
    @given(rates, jitters, stalls, starts)
    def test_times_never_go_back_and_are_never_in_the_future(self, rate, jitter, stalls, start_us):
        story = Story(rate, jitter, stalls, start_us, 10.0)
        told = story.told(BoardClock())
        assert all(a <= b for a, b in pairwise(told))
        assert all(t <= received for t, received in zip(told, story.received_s, strict=True))

    @settings(max_examples=200, deadline=None)
    @given(st.lists(st.tuples(st.integers(0, WRAP_US - 1), st.floats(0.0, 1e4)), max_size=80))
    def test_no_nonsense_of_a_board_breaks_that(self, readings):
        clock, before_s = BoardClock(), -math.inf
        for board_us, received_s in sorted(readings, key=lambda reading: reading[1]):
            told_s = clock.taken_s(board_us, received_s)
            assert before_s <= told_s <= received_s
            before_s = told_s

    @settings(max_examples=20, deadline=None)
    @given(rates, jitters, stalls, starts)
    def test_a_time_is_right_within_the_jitter_though_it_was_read_much_later(
        self, rate, jitter, stalls, start_us
    ):
        """The least delay cannot be seen; what was told late once is not taken back."""
        story = Story(rate, jitter, stalls, start_us, 10.0)
        told = story.told(BoardClock())
        wrong = [told_s - taken_s for told_s, taken_s in zip(told, story.taken_s, strict=True)][2500:]
        assert min(wrong) > -0.03
        assert max(wrong) < 0.03

    @settings(max_examples=10, deadline=None)
    @given(rates, jitters, stalls)
    def test_a_wrap_of_the_boards_clock_changes_nothing(self, rate, jitter, stalls):
        plain = Story(rate, jitter, stalls, 0, 5.0).told(BoardClock())
        wrapping = Story(rate, jitter, stalls, WRAP_US - 2_000_000, 5.0).told(BoardClock())
        assert wrapping == pytest.approx(plain, abs=1e-6)


@pytest.mark.parametrize("rate", [0.995, 0.9999, 1.0, 1.0001, 1.005])
def test_the_error_of_the_quartz_is_found(rate):
    clock = BoardClock()
    Story(rate, jitter=[0.0, 0.004, 0.001, 0.009, 0.002]).told(clock)
    assert clock.rate_error == pytest.approx(rate - 1, abs=5e-5)

    assert not clock.off


@settings(max_examples=20, deadline=None)
@given(rates, jitters, stalls)
def test_no_late_delivery_makes_a_resonator_that_is_good_look_off(rate, jitter, stalls):
    story, clock = Story(rate, jitter, stalls, 0, 10.0), BoardClock()
    for reading in zip(story.board_us, story.received_s, strict=True):
        clock.taken_s(*reading)
        assert not clock.off


@pytest.mark.parametrize("rate", [0.981, 0.985, 1.015, 1.019])
def test_a_clock_that_no_resonator_has_is_off_after_4_seconds_and_not_after_its_next_restart(rate):
    clock, story = BoardClock(), Story(rate, jitter=[0.0, 0.004, 0.001], lasts_s=6.0)
    offs = []
    for reading in zip(story.board_us, story.received_s, strict=True):
        clock.taken_s(*reading)
        offs.append(clock.off)
    assert not any(offs[:1900])
    assert all(offs[2200:])
    clock.restart()
    assert not clock.off


def test_in_the_first_seconds_the_error_is_not_known():
    clock = BoardClock()
    Story(1.005, lasts_s=1.5).told(clock)
    assert math.isnan(clock.rate_error)


@pytest.mark.parametrize("rate", [0.995, 1.005])
def test_with_a_quartz_that_is_off_by_half_a_percent_an_hour_later_ages_are_still_right(rate):
    clock, received_s = BoardClock(), 0.0
    for n in range(36_000):
        received_s = 0.1 * n
        told_s = clock.taken_s(round(received_s * rate * 1e6) % WRAP_US, received_s)
    assert told_s == pytest.approx(received_s, abs=0.001)


def test_a_backlog_read_at_once_has_the_ages_that_it_has():
    story = Story(1.003, stalls=[(5.0, 1.0)])
    ages = [
        received_s - told_s
        for told_s, received_s in zip(story.told(BoardClock()), story.received_s, strict=True)
    ]
    backlog = ages[2500:3000]
    assert backlog[0] == pytest.approx(1.0, abs=0.01)
    assert backlog[250] == pytest.approx(0.5, abs=0.01)
    assert max(ages[3000:]) < 0.005


@pytest.mark.parametrize("at_us", [1_000_000, 3_000_000_000])
def test_a_board_that_begins_anew_is_believed_at_once(at_us):
    clock = BoardClock()
    for n in range(2000):
        clock.taken_s(at_us + 2000 * n, 50.0 + 0.002 * n)
    assert clock.taken_s(0, 54.2) == pytest.approx(54.2)
    assert clock.taken_s(2000, 54.202) == pytest.approx(54.202)


def test_a_clock_that_stood_still_for_a_while_makes_samples_look_old_for_half_a_second_only():
    clock, ages = BoardClock(), []
    for n in range(3000):
        received_s = 0.002 * n + (0.4 if n >= 1500 else 0.0)
        ages.append(received_s - clock.taken_s(2000 * n, received_s))
    assert ages[1500] == pytest.approx(0.4, abs=0.01)
    assert max(ages[1760:]) < 0.001
