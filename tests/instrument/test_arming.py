"""Nothing inflates by surprise."""

import copy
import itertools
import math

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from instrument.arming import HOLD_REFUSALS, STEPS, Arming, Step
from instrument.faults import HostFault
from instrument.rig.frames import BoardState, Fault, Mode
from instrument.rig.link import RawSample
from tests.instrument.driving import HOLD, HOLD_8, PAGE, PLC, ROBOT, SETPOINT, VENT, Drive

STEPPED = {
    "vent": lambda drive: drive.write(VENT),
    "hold": lambda drive: drive.write(HOLD_8),
    "clear": lambda drive: drive.order("clear_faults"),
    "trip": lambda drive: drive.instrument.trip(HostFault.SENSOR_LIMIT),
}


def may_hold(steps):
    """The rule itself, written a second time: cleared, then vent seen, then hold."""
    faulty, vent_seen, holds, last_mode = False, False, False, "vent"
    for step in steps:
        if step == "trip":
            faulty, vent_seen, holds = True, False, False
        elif step == "clear":
            faulty = False
        elif step == "vent":
            vent_seen, holds, last_mode = not faulty, False, "vent"
        else:
            holds = holds or (not faulty and vent_seen and last_mode == "vent")
            last_mode = "hold"
    return holds


@pytest.mark.parametrize("first", STEPPED)
def test_in_every_order_of_four_steps_only_the_whole_way_leads_to_an_inflated_balloon(first):
    zeroed = Drive.zeroed()
    for rest in itertools.product(STEPPED, repeat=3):
        drive = copy.deepcopy(zeroed)
        for step in (first, *rest):
            STEPPED[step](drive)
        drive.run(0.1)
        assert drive.inflates == may_hold((first, *rest)), (first, *rest)


def test_every_state_can_be_tripped_cleared_and_vented():
    for state, row in STEPS.items():
        assert row[Step.TRIP] is Arming.TRIPPED
        assert {Step.CLEAR, Step.VENT} <= set(row), state


def test_only_a_ready_rig_begins_to_hold_and_the_others_say_why_not():
    assert {s for s, row in STEPS.items() if row.get(Step.HOLD) is Arming.HOLDING} == {
        Arming.READY,
        Arming.HOLDING,
    }
    assert set(HOLD_REFUSALS) == {state for state, row in STEPS.items() if Step.HOLD not in row}


def test_after_a_start_hold_is_refused_until_vent_was_seen():
    drive = Drive.zeroed()
    assert drive.write(HOLD_8) == "state"
    assert not drive.inflates
    drive.must(VENT)
    drive.must(HOLD_8)
    assert drive.inflates


def test_a_client_that_writes_hold_for_ever_cannot_inflate_a_tripped_rig():
    drive = Drive.holding()
    drive.instrument.trip(HostFault.SENSOR_LIMIT)
    for another in (None, "clear", None, "vent", None):
        if another == "clear":
            assert drive.order("clear_faults", peer=ROBOT) == ("done", "none")
        elif another == "vent":
            drive.must(VENT, ROBOT)
        for _ in range(50):
            assert drive.write(HOLD_8, PLC) != "none"
            drive.run(0.01)
            assert not drive.inflates


def test_another_peers_vent_is_not_undone_by_one_that_repeats_hold():
    drive = Drive.holding()
    drive.must(VENT, PAGE)
    assert drive.write(HOLD_8, PLC) == "state"
    drive.must(VENT, PLC)
    drive.must(HOLD_8, PLC)


def test_a_setpoint_written_in_vent_mode_is_stored_and_never_acted_on():
    drive = Drive.ready()
    drive.must({"setpoint_requested_kpa": 6.0})
    drive.run(0.5)
    assert not drive.inflates
    assert drive.instrument.command().setpoint_pa == 0
    assert math.isnan(drive.see().setpoint_kpa)
    assert drive.see().setpoint_requested_kpa == 6.0
    drive.must(HOLD)
    assert drive.instrument.command().setpoint_pa == 6000


def test_hold_without_any_setpoint_is_refused():
    drive = Drive.ready()
    assert drive.write(HOLD) == "state"
    drive.must(VENT)
    drive.must(SETPOINT)
    drive.must(HOLD)


def test_hold_is_refused_without_a_zero():
    drive = Drive.new()
    drive.offset_kpa = 2.0  # beyond what the data sheet allows
    drive.run(2.0)
    drive.must(VENT)
    assert drive.write(HOLD_8) == "not_zeroed"
    assert "not_zeroed" in drive.see().status


def test_hold_is_refused_while_the_link_is_lost():
    drive = Drive.ready()
    drive.now_s += 0.3
    assert drive.write(HOLD_8) == "link_lost"


def test_clearing_moves_no_valve_in_any_state():
    for drive in (Drive.zeroed(), Drive.ready(), Drive.holding()):
        before = drive.instrument.command()
        assert drive.order("clear_faults") == ("done", "none")
        after = drive.instrument.command()
        assert (before.mode, before.setpoint_pa) == (after.mode, after.setpoint_pa)


def test_a_restarted_board_is_tripped_and_its_setpoint_is_not_restored():
    drive = Drive.holding()
    drive.instrument.board_restarted()
    drive.run(0.5)
    assert not drive.inflates
    assert {"board_reset", "failure", "any_failure"} <= drive.see().status
    assert drive.see().state == "tripped"


def test_a_vent_reaches_the_board_even_when_hold_follows_before_anything_was_sent():
    drive = Drive.holding()
    drive.must(VENT)
    drive.must(HOLD_8)
    assert not drive.inflates
    drive.run(0.2)
    assert drive.sent == [Mode.VENT, Mode.HOLD, Mode.VENT, Mode.HOLD]
    assert drive.instrument.arming is Arming.HOLDING


def test_a_vent_right_after_hold_reaches_a_board_that_has_not_yet_shown_that_it_fills():
    drive = Drive.ready()
    drive.must(HOLD_8)
    drive.must(VENT)
    drive.must(HOLD_8)
    for _ in range(24):  # 48 ms, in which the vent may not yet have been heard
        assert not drive.inflates
        drive.feed()
    drive.run(0.2)
    assert drive.inflates


def test_a_board_may_take_long_to_empty_before_it_fills_again():
    drive = Drive.holding()
    drive.must(VENT)
    drive.run(0.02)
    drive.must(HOLD_8)
    for _ in range(2000):
        drive.feed(state=BoardState.VENTING, valves=0)
        drive.instrument.tick(drive.now_s)
    assert drive.instrument.arming is Arming.HOLDING
    assert len(drive.instrument.faults) == 0


def test_a_board_that_does_not_begin_to_fill_trips_the_host():
    drive = Drive.ready()
    drive.obeys = False
    drive.must(HOLD_8)
    drive.run(0.9)
    assert drive.see().first_fault == 0
    drive.run(0.3)
    assert drive.see().first_fault == HostFault.DISAGREEMENT
    assert not drive.inflates


def test_a_board_that_vents_without_being_asked_trips_the_host():
    drive = Drive.holding()
    for _ in range(600):
        drive.feed(state=BoardState.VENTING, valves=0)
    assert drive.see().first_fault == HostFault.DISAGREEMENT


def test_a_board_that_does_not_vent_is_told_apart_and_cannot_be_cleared():
    drive = Drive.holding()
    drive.must(VENT)
    for _ in range(490):
        drive.feed()  # it goes on holding
    assert drive.see().first_fault == 0
    for _ in range(20):
        drive.feed()
    seen = drive.see()
    assert (seen.state, seen.first_fault) == ("tripped", HostFault.NOT_VENTED)
    assert "vent_fault" in seen.status
    drive.obey = lambda: None
    assert drive.order("clear_faults") == ("failed", "cause_persists")


def test_what_the_board_did_before_it_was_told_is_not_held_against_it():
    drive = Drive.holding()
    stopped_s = drive.now_s
    drive.now_s += 1.2  # the process was stopped; meanwhile the board went on
    drive.instrument.tick(drive.now_s)
    for n in range(590):
        drive.instrument.take(RawSample(0, stopped_s + 0.002 * n, drive.sample()))
    drive.run(1.5)
    assert list(drive.instrument.faults) == [HostFault.LINK_LOST]


@pytest.mark.parametrize("mask", [1 << 15, 1 << 15 | 1 << 4])
def test_a_fault_that_only_a_later_board_knows_trips_like_any_other(mask):
    drive = Drive.holding()
    drive.feed(faults=mask, fault=15)
    assert drive.see().state == "tripped"
    assert not drive.inflates
    assert 15 in drive.see().faults
    drive.must(VENT)


def test_a_board_that_heard_nothing_for_a_while_is_not_blamed_for_it():
    drive = Drive.holding()
    drive.silence(1.5)
    drive.feed()  # still locked: the vent is yet to reach it
    drive.run(0.5)
    assert list(drive.instrument.faults) == [HostFault.LINK_LOST]


class AnyTraffic(RuleBasedStateMachine):
    """Whatever is asked, trips or falls silent: the rig holds only where the rules were followed."""

    def __init__(self):
        super().__init__()
        self.drive = Drive.zeroed()
        self.vent_seen = False  # by anybody, since start or the last trip, with no fault left
        self.last_mode = {}
        self.asked = False  # "hold" was asked as a wish of today since the last vent

    def note_trip(self):
        if len(self.drive.instrument.faults):
            self.vent_seen = self.asked = False

    @rule(peer=st.sampled_from([PLC, ROBOT, PAGE]), more=st.sampled_from([{}, SETPOINT, {"lease_s": 0.3}]))
    def vent(self, peer, more):
        self.note_trip()
        self.drive.write(VENT | more, peer)
        self.last_mode[peer] = "vent"
        self.vent_seen = not len(self.drive.instrument.faults)
        self.asked = False
        assert not self.drive.inflates

    @rule(
        peer=st.sampled_from([PLC, ROBOT, PAGE]),
        more=st.sampled_from([{}, SETPOINT, {"lease_s": 0.3} | SETPOINT]),
    )
    def hold(self, peer, more):
        self.note_trip()
        accepted = self.drive.write(HOLD | more, peer) == "none"
        meant = self.asked or (self.vent_seen and self.last_mode.get(peer, "vent") == "vent")
        self.last_mode[peer] = "hold"
        assert meant or not accepted
        self.asked = self.asked or accepted

    @rule(peer=st.sampled_from([PLC, ROBOT]), lease_s=st.sampled_from([0.0, 0.3, 1.0]))
    def lease(self, peer, lease_s):
        self.drive.write({"lease_s": lease_s}, peer)

    @rule(code=st.sampled_from(["clear_faults", "zero_pressure", "undo_zero", "self_test", "new_balloon"]))
    def order(self, code):
        before = self.drive.inflates
        self.drive.order(code)
        self.note_trip()
        assert before or not self.drive.inflates

    @rule(fault=st.sampled_from([*list(Fault)[1:], *HostFault]))
    def trip(self, fault):
        self.drive.instrument.trip(fault)
        self.note_trip()
        assert not self.drive.inflates

    @rule(fault=st.sampled_from(list(Fault)[1:]), lasts=st.booleans())
    def board_trips(self, fault, lasts):
        self.drive.latched.add(fault)
        if lasts:
            self.drive.causes.add(fault)
        self.drive.run(0.02)
        self.note_trip()

    @precondition(lambda self: self.drive.causes)
    @rule()
    def causes_go(self):
        self.drive.causes.clear()

    @rule(push_kpa=st.sampled_from([0.0, 1.0, 7.0, 12.0]))
    def press(self, push_kpa):
        self.drive.push_kpa = push_kpa

    @rule(seconds=st.sampled_from([0.01, 0.1, 0.5]))
    def samples(self, seconds):
        self.drive.run(seconds)
        self.note_trip()

    @rule(seconds=st.sampled_from([0.05, 0.2, 0.3, 1.0]))
    def silence(self, seconds):
        self.drive.silence(seconds)
        self.note_trip()

    @invariant()
    def holds_only_by_the_rules(self):
        instrument = self.drive.instrument
        if self.drive.inflates:
            waits = instrument.vent_pending and list(instrument.faults) == [HostFault.LEASE_EXPIRED]
            assert (self.asked and not len(instrument.faults)) or waits
            assert instrument.chain.zero.taken
            assert 2000 <= instrument.command().setpoint_pa <= 12000

    @invariant()
    def a_snapshot_can_always_be_taken(self):
        self.drive.see()


TestAnyTraffic = AnyTraffic.TestCase
TestAnyTraffic.settings = settings(max_examples=60, stateful_step_count=25, deadline=None)
