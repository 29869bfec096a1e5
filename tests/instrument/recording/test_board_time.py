"""Tests of the time on the clock of the board: repeated host times, overflow, and a restart of the board."""

import pytest

from pneuforce.instrument.recording.board_time import BoardTime
from pneuforce.instrument.stream.sample_record import SampleRecord

SAMPLE = SampleRecord(*[0] * len(SampleRecord._fields))


def times_s(*clocks):
    board = BoardTime()
    return [board.at_s(SAMPLE._replace(board_time_us=us, t_s=t_s)) for us, t_s in clocks]


def test_samples_with_the_same_host_time_have_different_board_times():
    assert times_s((5000, 1.0), (7000, 1.0), (9000, 1.0)) == [0.0, 0.002, 0.004]


def test_the_overflow_of_the_board_clock_is_removed():
    assert times_s((2**32 - 1000, 1.0), (1000, 1.002), (3000, 1.004)) == [0.0, 0.002, 0.004]


@pytest.mark.parametrize("before_us", [10_000_000, 3_000_000_000])
def test_after_a_restart_of_the_board_the_host_clock_bridges_the_gap(before_us):
    assert times_s((before_us, 100.0), (2000, 101.5), (4000, 101.502)) == [0.0, 1.5, 1.502]


def test_a_late_delivery_does_not_change_the_board_time():
    assert times_s((0, 1.0), (2000, 3.0), (4000, 3.0)) == [0.0, 0.002, 0.004]
