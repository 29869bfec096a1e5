"""Tests of the board clock in simulated time: rate errors, late reads, wraps and restarts."""

import math
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pneuforce.instrument.rig.board_clock import WRAP_US, BoardClock

MIN_DELAY_S = 0.001
rates = st.floats(0.995, 1.005)
jitters = st.lists(st.floats(0.0, 0.02), min_size=20, max_size=60).map(lambda delays_s: [*delays_s, 0.0])


def are_apart(stalls):
    """Return True if the reader works for at least 0.5 s between two stalls.

    If samples are read in two groups during one long delay, the board clock seems to have stopped. Only the
    command echo distinguishes a delay from a stopped clock (test_command_echo.py).
    """
    return all(a + duration + 0.5 <= b for (a, duration), (b, _) in pairwise(sorted(stalls)))


#: Begin and duration [s] of each time in which the host reads no bytes.
stalls = st.lists(st.tuples(st.floats(0.0, 20.0), st.floats(0.0, 1.0)), max_size=4).filter(are_apart)
starts = st.sampled_from([0, 1, WRAP_US - 3_000_000, WRAP_US // 2 - 1]) | st.integers(0, WRAP_US - 1)


class Readings:
    """Samples as three lists: board times, host times of the sampling, and host times of the reading."""

    def __init__(self, rate=1.0, jitter=(0.0,), stalls=(), start_us=0, duration_s=20.0):
        self.taken_s = [100.0 + 0.002 * n for n in range(round(duration_s / 0.002))]
        self.board_us = [(start_us + round((t - 100.0) * rate * 1e6)) % WRAP_US for t in self.taken_s]
        self.received_s = []
        for n, taken_s in enumerate(self.taken_s):
            arrives_s = taken_s + MIN_DELAY_S + jitter[n % len(jitter)]
            for stall_s, stall_duration_s in stalls:  # nothing is read while the reader is suspended
                if stall_s <= arrives_s - 100.0 < stall_s + stall_duration_s:
                    arrives_s = 100.0 + stall_s + stall_duration_s
            self.received_s.append(max(arrives_s, self.received_s[-1] if n else arrives_s))

    def host_times_s(self, clock):
        return [clock.host_time_s(*reading) for reading in zip(self.board_us, self.received_s, strict=True)]


class TestAnyDelays:
    """Tests of the properties that host times have for any delays."""

    @settings(max_examples=25)
    @given(rates, jitters, stalls, starts)
    def test_host_times_never_decrease_and_are_never_in_the_future(self, rate, jitter, stalls, start_us):
        readings = Readings(rate, jitter, stalls, start_us, 10.0)
        times_s = readings.host_times_s(BoardClock())
        assert all(a <= b for a, b in pairwise(times_s))
        assert all(t <= received for t, received in zip(times_s, readings.received_s, strict=True))

    @settings(max_examples=200)
    @given(st.lists(st.tuples(st.integers(0, WRAP_US - 1), st.floats(0.0, 1e4)), max_size=80))
    def test_random_board_times_give_no_decreasing_and_no_future_host_times(self, readings):
        clock, before_s = BoardClock(), -math.inf
        for board_us, received_s in sorted(readings, key=lambda reading: reading[1]):
            time_s = clock.host_time_s(board_us, received_s)
            assert before_s <= time_s <= received_s
            before_s = time_s

    @settings(max_examples=20)
    @given(rates, jitters, stalls, starts)
    def test_a_time_is_correct_within_the_jitter_even_if_the_sample_is_read_late(
        self, rate, jitter, stalls, start_us
    ):
        """The errors have two causes: the smallest delay is unknown, and host times never decrease."""
        readings = Readings(rate, jitter, stalls, start_us, 10.0)
        times_s = readings.host_times_s(BoardClock())
        error_s = [time_s - taken_s for time_s, taken_s in zip(times_s, readings.taken_s, strict=True)][2500:]
        assert min(error_s) > -0.03
        assert max(error_s) < 0.03

    @settings(max_examples=10)
    @given(rates, jitters, stalls)
    def test_a_wrap_of_the_boards_clock_changes_nothing(self, rate, jitter, stalls):
        plain = Readings(rate, jitter, stalls, 0, 5.0).host_times_s(BoardClock())
        wrapping = Readings(rate, jitter, stalls, WRAP_US - 2_000_000, 5.0).host_times_s(BoardClock())
        assert wrapping == pytest.approx(plain, abs=1e-6)


@pytest.mark.parametrize("rate", [0.995, 0.9999, 1.0, 1.0001, 1.005])
def test_the_rate_error_is_measured(rate):
    clock = BoardClock()
    Readings(rate, jitter=[0.0, 0.004, 0.001, 0.009, 0.002]).host_times_s(clock)
    assert clock.rate_error == pytest.approx(rate - 1, abs=5e-5)
    assert not clock.out_of_tolerance


@settings(max_examples=20)
@given(rates, jitters, stalls)
def test_late_deliveries_do_not_make_a_good_resonator_look_faulty(rate, jitter, stalls):
    readings, clock = Readings(rate, jitter, stalls, 0, 10.0), BoardClock()
    for reading in zip(readings.board_us, readings.received_s, strict=True):
        clock.host_time_s(*reading)
        assert not clock.out_of_tolerance


@pytest.mark.parametrize("rate", [0.981, 0.985, 1.015, 1.019])
def test_a_clock_fault_is_detected_after_4_seconds_and_cleared_by_a_restart(rate):
    clock, readings = BoardClock(), Readings(rate, jitter=[0.0, 0.004, 0.001], duration_s=6.0)
    faults = []
    for reading in zip(readings.board_us, readings.received_s, strict=True):
        clock.host_time_s(*reading)
        faults.append(clock.out_of_tolerance)
    assert not any(faults[:1900])
    assert all(faults[2200:])
    clock.restart()
    assert not clock.out_of_tolerance


def test_the_rate_error_is_unknown_in_the_first_two_seconds():
    clock = BoardClock()
    Readings(1.005, duration_s=1.5).host_times_s(clock)
    assert math.isnan(clock.rate_error)


@pytest.mark.parametrize("rate", [0.995, 1.005])
def test_a_rate_error_of_half_a_percent_does_not_add_up_within_an_hour(rate):
    clock, received_s = BoardClock(), 0.0
    for n in range(36_000):
        received_s = 0.1 * n
        time_s = clock.host_time_s(round(received_s * rate * 1e6) % WRAP_US, received_s)
    assert time_s == pytest.approx(received_s, abs=0.001)


def test_samples_of_a_backlog_have_their_true_ages():
    readings = Readings(1.003, stalls=[(5.0, 1.0)])
    ages = [
        received_s - time_s
        for time_s, received_s in zip(readings.host_times_s(BoardClock()), readings.received_s, strict=True)
    ]
    backlog = ages[2500:3000]
    assert backlog[0] == pytest.approx(1.0, abs=0.01)
    assert backlog[250] == pytest.approx(0.5, abs=0.01)
    assert max(ages[3000:]) < 0.005


@pytest.mark.parametrize("at_us", [1_000_000, 3_000_000_000])
def test_a_restarted_board_clock_is_used_immediately(at_us):
    clock = BoardClock()
    for n in range(2000):
        clock.host_time_s(at_us + 2000 * n, 50.0 + 0.002 * n)
    assert clock.host_time_s(0, 54.2) == pytest.approx(54.2)
    assert clock.host_time_s(2000, 54.202) == pytest.approx(54.202)


def test_after_a_stop_of_the_clock_samples_look_old_for_half_a_second_only():
    clock, ages = BoardClock(), []
    for n in range(3000):
        received_s = 0.002 * n + (0.4 if n >= 1500 else 0.0)
        ages.append(received_s - clock.host_time_s(2000 * n, received_s))
    assert ages[1500] == pytest.approx(0.4, abs=0.01)
    assert max(ages[1760:]) < 0.001
