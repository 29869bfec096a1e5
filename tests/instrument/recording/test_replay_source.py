"""Tests of a replay on the buses: the values are those of the recording, and are marked as simulated."""

import json
import logging

import pytest

from pneuforce.instrument.core.faults import HostFault
from pneuforce.instrument.core.reject_reason import RejectReason
from pneuforce.instrument.recording.paced_replay import PacedReplay
from pneuforce.instrument.recording.replay_source import ReplaySource
from pneuforce.instrument.stream.entry import EntryKind
from pneuforce.support.rejected_write import RejectedWrite
from tests.instrument.recording.virtual_host import PLC, ROBOT, advance, inputs, make_replay, samples, session


def test_a_bus_shows_the_recorded_measurement():
    replay = make_replay()
    source, recorded = ReplaySource(replay), {sample.t_s: sample for sample in samples()}
    advance(replay, 2.5)
    seen = source.snapshot(PLC, 123.0)
    sample = recorded[replay.session.instrument.measurement.t_s]
    assert (seen.force_n, seen.pressure_kpa, seen.radius_mm) == (
        sample.force_n,
        sample.pressure_kpa,
        sample.radius_mm,
    )
    assert seen.age_s < 0.02


def test_a_recorded_lease_expires_at_the_replay_speed():
    """At twice the speed, half a second of the lease passes in a quarter of a second."""
    entries = inputs()
    taken_s = next(e.t_s for e in entries if e.kind is EntryKind.WRITE and "lease_s" in json.loads(e.body)[2])
    replay = make_replay(speed=2.0)
    source, now_s = ReplaySource(replay), 0.0
    while not source.snapshot(PLC, now_s).lease_left_s > 0.9:
        now_s += 0.002
        list(replay.advance(now_s))
    assert replay.t_s == pytest.approx(taken_s, abs=0.02)
    advance(replay, 0.25, now_s)
    assert source.snapshot(PLC, now_s).lease_left_s == pytest.approx(0.5, abs=0.05)


def test_a_replay_is_always_marked_as_simulated_and_write_protected():
    replay = make_replay()
    source = ReplaySource(replay)
    for step in range(2000):
        list(replay.advance(step * 0.01))
        assert source.snapshot(ROBOT, 0.0).status >= {"simulated", "function_check", "write_protect"}


def test_writes_are_rejected_and_a_vent_is_accepted_without_effect():
    replay = make_replay()
    source = ReplaySource(replay)
    advance(replay, 0.5)
    before = replay.session.instrument.snapshot(PLC, replay.t_s)
    assert source.write(PLC, {"setpoint_requested_kpa": 5.0}, 0.0) == "write_protect"
    assert source.snapshot(PLC, 0.0).reject_reason is RejectReason.WRITE_PROTECT
    assert source.snapshot(ROBOT, 0.0).reject_reason is RejectReason.NONE
    assert source.write(PLC, {"mode": "hold"}, 0.0) == "write_protect"
    assert source.write(PLC, {"mode": "vent", "lease_s": 1.0}, 0.0) == "write_protect"
    assert source.write(PLC, {"mode": "vent"}, 0.0) == "none"
    assert source.counts.rejected_writes == {"write_protect": 3}
    assert source.snapshot(PLC, 0.0).reject_reason is RejectReason.NONE
    assert repr(replay.session.instrument.snapshot(PLC, replay.t_s)) == repr(before)


def test_a_rejected_write_is_logged_with_the_reason_that_this_is_a_replay(caplog):
    source = ReplaySource(make_replay())
    with caplog.at_level(logging.INFO):
        source.write(PLC, {"mode": "hold"}, 0.0)
        source.log_rejected_write(PLC, RejectedWrite(b"", "illegal_value", "mode 7"), 0.0)
    rejected, illegal = caplog.messages
    assert "replay" in rejected
    assert "configuration" not in rejected
    assert "mode 7" in illegal


def test_after_the_end_of_the_recording_the_link_is_lost_and_values_are_not_available():
    short = inputs()[:1000]
    replay = PacedReplay(lambda: (session(), iter(short)))
    source = ReplaySource(replay)
    advance(replay, 1.0)
    assert not replay.finished
    assert source.snapshot(PLC, 0.0).force_n >= 0
    advance(replay, 4.0, 51.0)
    assert replay.finished
    seen = source.snapshot(PLC, 0.0)
    assert seen.status >= {"stale", "link_lost", "simulated", "failure"}
    assert seen.force_n != seen.force_n
    assert seen.age_s > 1.0
    assert seen.state == "tripped"
    assert HostFault.LINK_LOST in seen.faults
