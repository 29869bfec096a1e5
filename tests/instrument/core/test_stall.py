"""Tests of stalls of the host process: they do not count as silence of the board or of a peer."""

import pytest

from pneuforce.instrument.core.faults import HostFault
from pneuforce.instrument.core.stall_monitor import StallMonitor
from tests.instrument.instrument_harness import HOLD_8, PLC, ROBOT, SETPOINT, InstrumentHarness

LEASED = {"lease_s": 0.5}


def tick(harness):
    harness.instrument.tick(harness.now_s)
    return harness


def stall(harness, seconds):
    """Let time pass without ticks and samples, then tick once, as the loop does after a stall."""
    harness.now_s += seconds
    return tick(harness)


def first_out(harness):
    return harness.snapshot().first_out_fault


@pytest.mark.parametrize(("gap_s", "stall_s"), [(0.01, 0.0), (0.1, 0.0), (0.11, 0.11), (3.0, 3.0)])
def test_a_gap_of_more_than_100_ms_is_a_stall(gap_s, stall_s):
    monitor = StallMonitor()
    assert monitor.update(0.0) == 0.0
    assert monitor.update(gap_s) == stall_s
    assert monitor.buffered_s(gap_s + 0.2) == stall_s
    assert monitor.buffered_s(gap_s + 0.3) == 0.0
    assert monitor.active_s(0.0, gap_s + 0.3) == pytest.approx(gap_s + 0.3 - stall_s)
    assert monitor.active_s(gap_s + 0.1, gap_s + 0.3) == pytest.approx(0.2)


def test_stalls_on_a_busy_computer_are_logged_once_per_minute_with_their_number(caplog):
    harness = InstrumentHarness.holding()
    caplog.clear()
    for number in range(100):
        stall(harness, 0.5 if number == 50 else 0.3)
        harness.feed()
    assert len(caplog.messages) == 1
    assert "did not run for 0.30 s" in caplog.messages[0]
    caplog.clear()
    harness.run(60.0)
    assert len(caplog.messages) == 1
    assert "99 times, at most for 0.50 s" in caplog.messages[0]


@pytest.mark.parametrize("stall_s", [0.3, 1.0, 1.9])
def test_a_stall_does_not_trip_if_the_samples_of_that_time_follow(stall_s):
    harness = stall(InstrumentHarness.holding(), stall_s)
    assert harness.commands_hold
    harness.run(0.5)
    assert (harness.commands_hold, first_out(harness)) == (True, 0)


def test_the_values_are_stale_until_samples_follow():
    harness = stall(InstrumentHarness.holding(), 0.3)
    assert "stale" in harness.snapshot().status
    assert harness.snapshot().state == "holding"  # a stall is no trip
    assert harness.snapshot().force_n != harness.snapshot().force_n  # NaN
    harness.feed()
    assert "stale" not in harness.snapshot().status


def test_a_link_that_was_lost_in_a_stall_trips_a_quarter_of_a_second_later():
    harness = stall(InstrumentHarness.holding(), 0.5).run_without_samples(0.25)
    assert harness.commands_hold
    harness.run_without_samples(0.01)
    assert (harness.commands_hold, first_out(harness)) == (False, 34)


def test_repeated_stalls_postpone_the_trip_at_most_until_the_board_has_vented():
    harness = InstrumentHarness.holding(host_timeout_s=1.0)
    for _ in range(4):
        stall(harness, 0.24)
    assert harness.commands_hold
    stall(harness, 0.24)
    assert (harness.commands_hold, first_out(harness)) == (False, 34)


CLOSE_STALLS_S = (0.06, 0.15, 0.5, 1.5)


@pytest.mark.parametrize("between_s", [0.004, 0.05, 0.3])
def test_close_stalls_do_not_trip_if_the_host_reads_samples_and_requests_between_them(between_s):
    harness = InstrumentHarness.holding(PLC, LEASED)
    for stall_s in CLOSE_STALLS_S * 3:
        stall(harness, stall_s)
        harness.write_ok(SETPOINT)
        harness.run(between_s)
    assert (harness.commands_hold, first_out(harness)) == (True, 0)


def test_close_stalls_trip_if_the_host_reads_no_samples_between_them():
    harness = InstrumentHarness.holding(PLC, LEASED)
    for stall_s in CLOSE_STALLS_S[:-1]:
        stall(harness, stall_s)
    assert harness.commands_hold
    stall(harness, CLOSE_STALLS_S[-1])  # the latest sample is now older than host_timeout_s
    assert (harness.commands_hold, first_out(harness)) == (False, 34)


def test_silence_without_a_stall_trips_after_a_quarter_of_a_second():
    harness = InstrumentHarness.holding().run_without_samples(0.25)
    assert harness.commands_hold
    harness.run_without_samples(0.02)
    assert (harness.commands_hold, first_out(harness)) == (False, 34)


def test_a_lease_that_expires_in_a_stall_can_still_be_renewed():
    harness = InstrumentHarness.holding(PLC, LEASED)
    harness.now_s += 0.6
    harness.write_ok(SETPOINT)
    harness.run(0.4)
    assert (harness.commands_hold, first_out(harness)) == (True, 0)


def test_a_lease_that_expires_in_a_stall_still_excludes_others():
    harness = stall(InstrumentHarness.holding(PLC, LEASED), 0.6)
    assert harness.write(HOLD_8, ROBOT) == "lease"


def test_repeated_stalls_postpone_the_end_of_a_lease_at_most_by_the_host_timeout():
    """The host reads all samples and requests between the stalls, and the holder of the lease is silent."""
    harness = InstrumentHarness.holding(PLC, LEASED, host_timeout_s=1.0)
    silent_s = 0.0
    while not first_out(harness):
        stall(harness, 0.15).run(0.05)
        silent_s += 0.2
        assert silent_s < 2.0
    assert first_out(harness) == 32
    assert silent_s == pytest.approx(LEASED["lease_s"] + 1.0, abs=0.3)


def test_after_a_stall_that_trips_the_rig_a_renewed_lease_is_no_fault():
    """The renewals waited in the buffers while the host process was stopped."""
    harness = InstrumentHarness.holding()
    harness.write_ok(LEASED)
    stall(harness, 3.0)
    harness.write_ok(LEASED)
    harness.run(0.1)
    harness.write_ok(LEASED)
    harness.run(0.4)
    assert harness.snapshot().faults == (HostFault.LINK_LOST,)
    harness.run(0.2)
    assert HostFault.LEASE_EXPIRED in harness.snapshot().faults


def test_a_lease_that_is_not_renewed_after_a_stall_trips():
    harness = stall(InstrumentHarness.holding(PLC, LEASED), 0.6).run(0.27)
    assert (harness.commands_hold, first_out(harness)) == (False, 32)


def test_a_stall_is_logged(caplog):
    stall(InstrumentHarness.holding(), 0.42)
    assert "0.42 s" in caplog.text
