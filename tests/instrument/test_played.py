"""A replay as buses see it: what was recorded, and nothing that a robot could take for a rig."""

import json

import pytest

from instrument.faults import HostFault
from instrument.played import Played
from instrument.refusal import Refusal
from instrument.tape.entry import Kind
from instrument.tape.playing import Playing
from tests.instrument.tape.virtual_host import (
    PLC,
    ROBOT,
    coupling,
    inputs,
    play,
    playing,
    samples,
)


def test_what_a_bus_sees_is_what_was_measured_then():
    show = playing()
    shown, recorded = Played(show), {sample.t_s: sample for sample in samples()}
    play(show, 2.5)
    seen = shown.snapshot(PLC, 123.0)
    was = recorded[show.coupling.instrument.measurement.t_s]
    assert (seen.force_n, seen.pressure_kpa, seen.radius_mm) == (was.force_n, was.pressure_kpa, was.radius_mm)
    assert seen.age_s < 0.02


def test_a_lease_runs_as_it_ran():
    """Recorded while the lease of 1 s ran: half a second of it is over after a quarter at twice the speed."""
    entries = inputs()
    taken_s = next(e.t_s for e in entries if e.kind is Kind.WRITE and "lease_s" in json.loads(e.body)[2])
    show = playing(speed=2.0)
    shown, now_s = Played(show), 0.0
    while not shown.snapshot(PLC, now_s).lease_left_s > 0.9:
        now_s += 0.002
        list(show.advance(now_s))
    assert show.t_s == pytest.approx(taken_s, abs=0.02)
    play(show, 0.25, now_s)
    assert shown.snapshot(PLC, now_s).lease_left_s == pytest.approx(0.5, abs=0.05)


def test_no_robot_takes_it_for_a_rig():
    show = playing()
    shown = Played(show)
    for step in range(2000):
        list(show.advance(step * 0.01))
        assert shown.snapshot(ROBOT, 0.0).status >= {"simulated", "function_check", "write_lock"}


def test_writes_are_refused_and_change_nothing_but_a_vent_is_accepted():
    show = playing()
    shown = Played(show)
    play(show, 0.5)
    before = show.coupling.instrument.snapshot(PLC, show.t_s)
    assert shown.write(PLC, {"setpoint_requested_kpa": 5.0}, 0.0) == "write_lock"
    assert shown.snapshot(PLC, 0.0).refusal is Refusal.WRITE_LOCK
    assert shown.snapshot(ROBOT, 0.0).refusal is Refusal.NONE
    assert shown.write(PLC, {"mode": "hold"}, 0.0) == "write_lock"
    assert shown.write(PLC, {"mode": "vent", "lease_s": 1.0}, 0.0) == "write_lock"
    assert shown.write(PLC, {"mode": "vent"}, 0.0) == "none"
    assert shown.snapshot(PLC, 0.0).refusal is Refusal.NONE
    assert repr(show.coupling.instrument.snapshot(PLC, show.t_s)) == repr(before)


def test_after_its_end_the_link_is_lost_and_nothing_is_available():
    short = inputs()[:1000]
    show = Playing(lambda: (coupling(), iter(short)))
    shown = Played(show)
    play(show, 1.0)
    assert not show.over
    assert shown.snapshot(PLC, 0.0).force_n >= 0
    play(show, 4.0, 51.0)
    assert show.over
    seen = shown.snapshot(PLC, 0.0)
    assert seen.status >= {"stale", "link_lost", "simulated", "failure"}
    assert seen.force_n != seen.force_n
    assert seen.age_s > 1.0
    assert seen.state == "tripped"
    assert HostFault.LINK_LOST in seen.faults
