"""Tests of arming: the balloon is never inflated unexpectedly."""

import copy
import itertools
import math

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from pneuforce.instrument.core.arming import HOLD_REJECT_REASONS, STEPS, Arming, Step
from pneuforce.instrument.core.faults import HostFault
from pneuforce.instrument.rig.link import RawSample
from pneuforce.protocol.frames import BoardState, Fault, Mode
from tests.instrument.instrument_harness import (
    HOLD,
    HOLD_8,
    PLC,
    ROBOT,
    SETPOINT,
    VENT,
    WEB,
    InstrumentHarness,
)

STEPPED = {
    "vent": lambda harness: harness.write(VENT),
    "hold": lambda harness: harness.write(HOLD_8),
    "clear": lambda harness: harness.run_command("clear_faults"),
    "trip": lambda harness: harness.instrument.trip(HostFault.SENSOR_LIMIT),
}


def may_hold(steps):
    """Return True if a sequence of steps inflates the balloon: no fault, then vent, then hold.

    This second implementation of the rule is independent of `STEPS`.
    """
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
def test_of_all_orders_of_four_steps_only_the_complete_one_inflates(first):
    zeroed = InstrumentHarness.zeroed()
    for rest in itertools.product(STEPPED, repeat=3):
        harness = copy.deepcopy(zeroed)
        for step in (first, *rest):
            STEPPED[step](harness)
        harness.run(0.1)
        assert harness.commands_hold == may_hold((first, *rest)), (first, *rest)


def test_every_state_can_be_tripped_cleared_and_vented():
    for state, row in STEPS.items():
        assert row[Step.TRIP] is Arming.TRIPPED
        assert {Step.CLEAR, Step.VENT} <= set(row), state


def test_only_a_ready_rig_holds_and_other_states_give_a_reject_reason():
    assert {s for s, row in STEPS.items() if row.get(Step.HOLD) is Arming.HOLDING} == {
        Arming.READY,
        Arming.HOLDING,
    }
    assert set(HOLD_REJECT_REASONS) == {state for state, row in STEPS.items() if Step.HOLD not in row}


def test_after_a_start_hold_is_rejected_until_a_vent():
    harness = InstrumentHarness.zeroed()
    assert harness.write(HOLD_8) == "state"
    assert not harness.commands_hold
    harness.write_ok(VENT)
    harness.write_ok(HOLD_8)
    assert harness.commands_hold


def test_a_client_that_repeats_hold_cannot_inflate_a_tripped_rig():
    harness = InstrumentHarness.holding()
    harness.instrument.trip(HostFault.SENSOR_LIMIT)
    for another in (None, "clear", None, "vent", None):
        if another == "clear":
            assert harness.run_command("clear_faults", peer=ROBOT) == ("done", "none")
        elif another == "vent":
            harness.write_ok(VENT, ROBOT)
        for _ in range(50):
            assert harness.write(HOLD_8, PLC) != "none"
            harness.run(0.01)
            assert not harness.commands_hold


def test_a_peer_that_repeats_hold_does_not_undo_the_vent_of_another():
    harness = InstrumentHarness.holding()
    harness.write_ok(VENT, WEB)
    assert harness.write(HOLD_8, PLC) == "state"
    harness.write_ok(VENT, PLC)
    harness.write_ok(HOLD_8, PLC)


def test_a_setpoint_written_in_vent_mode_is_stored_and_has_no_effect():
    harness = InstrumentHarness.ready()
    harness.write_ok({"setpoint_requested_kpa": 6.0})
    harness.run(0.5)
    assert not harness.commands_hold
    assert harness.instrument.command().setpoint_pa == 0
    assert math.isnan(harness.snapshot().setpoint_kpa)
    assert harness.snapshot().setpoint_requested_kpa == 6.0
    harness.write_ok(HOLD)
    assert harness.instrument.command().setpoint_pa == 6000


def test_hold_without_a_setpoint_is_rejected():
    harness = InstrumentHarness.ready()
    assert harness.write(HOLD) == "state"
    harness.write_ok(VENT)
    harness.write_ok(SETPOINT)
    harness.write_ok(HOLD)


def test_hold_is_rejected_without_a_zero():
    harness = InstrumentHarness.new()
    harness.offset_kpa = 2.0  # outside the limits of the data sheet
    harness.run(2.0)
    harness.write_ok(VENT)
    assert harness.write(HOLD_8) == "not_zeroed"
    assert "not_zeroed" in harness.snapshot().status


def test_hold_is_rejected_while_the_link_is_lost():
    harness = InstrumentHarness.ready()
    harness.now_s += 0.3
    assert harness.write(HOLD_8) == "link_lost"


def test_clearing_moves_no_valve_in_any_state():
    for harness in (InstrumentHarness.zeroed(), InstrumentHarness.ready(), InstrumentHarness.holding()):
        before = harness.instrument.command()
        assert harness.run_command("clear_faults") == ("done", "none")
        after = harness.instrument.command()
        assert (before.mode, before.setpoint_pa) == (after.mode, after.setpoint_pa)


def test_a_restarted_board_is_tripped_and_its_setpoint_is_not_restored():
    harness = InstrumentHarness.holding()
    harness.instrument.board_restarted()
    harness.run(0.5)
    assert not harness.commands_hold
    assert {"board_reset", "failure", "any_failure"} <= harness.snapshot().status
    assert harness.snapshot().state == "tripped"


def test_a_vent_is_sent_even_if_hold_follows_before_the_next_command():
    harness = InstrumentHarness.holding()
    harness.write_ok(VENT)
    harness.write_ok(HOLD_8)
    assert not harness.commands_hold
    harness.run(0.2)
    assert harness.sent == [Mode.VENT, Mode.HOLD, Mode.VENT, Mode.HOLD]
    assert harness.instrument.arming is Arming.HOLDING


def test_a_vent_right_after_hold_is_sent_even_if_no_sample_shows_the_hold_yet():
    harness = InstrumentHarness.ready()
    harness.write_ok(HOLD_8)
    harness.write_ok(VENT)
    harness.write_ok(HOLD_8)
    for _ in range(24):  # for 48 ms the board may not have received the vent command
        assert not harness.commands_hold
        harness.feed()
    harness.run(0.2)
    assert harness.commands_hold


def test_a_board_may_take_long_to_empty_before_it_fills_again():
    harness = InstrumentHarness.holding()
    harness.write_ok(VENT)
    harness.run(0.02)
    harness.write_ok(HOLD_8)
    for _ in range(2000):
        harness.feed(state=BoardState.VENTING, valves=0)
        harness.instrument.tick(harness.now_s)
    assert harness.instrument.arming is Arming.HOLDING
    assert len(harness.instrument.faults) == 0


def test_a_board_that_does_not_begin_to_fill_trips_the_host():
    harness = InstrumentHarness.ready()
    harness.follows_commands = False
    harness.write_ok(HOLD_8)
    harness.run(0.9)
    assert harness.snapshot().first_out_fault == 0
    harness.run(0.3)
    assert harness.snapshot().first_out_fault == HostFault.DISAGREEMENT
    assert not harness.commands_hold


def test_a_board_that_vents_without_a_command_trips_the_host():
    harness = InstrumentHarness.holding()
    for _ in range(600):
        harness.feed(state=BoardState.VENTING, valves=0)
    assert harness.snapshot().first_out_fault == HostFault.DISAGREEMENT


def test_a_board_that_does_not_vent_has_a_separate_fault_that_cannot_be_cleared():
    harness = InstrumentHarness.holding()
    harness.follow_command = lambda: None  # the board still holds
    harness.write_ok(VENT)
    harness.run(0.98)
    assert harness.snapshot().first_out_fault == 0
    harness.run(0.06)
    seen = harness.snapshot()
    assert (seen.state, seen.first_out_fault) == ("tripped", HostFault.NOT_VENTED)
    assert "vent_fault" in seen.status
    assert harness.run_command("clear_faults") == ("failed", "cause_persists")


@pytest.mark.parametrize("period_s", [0.02, 0.1, 0.5, 0.9])
@pytest.mark.parametrize("orders", [(VENT, HOLD_8), (VENT,)], ids=["vent and hold", "vent only"])
def test_orders_in_a_fast_sequence_do_not_hide_a_board_that_does_not_vent(orders, period_s):
    """Each order restarted the time limit, so the rig did not trip while a client alternated its orders."""
    harness = InstrumentHarness.holding()
    harness.follow_command = lambda: None  # the board still holds
    modes, passed_s = itertools.cycle(orders), 0.0
    while not harness.instrument.faults and passed_s < 3.0:
        harness.write(next(modes))
        harness.run(period_s)
        passed_s += period_s
    assert harness.snapshot().first_out_fault == HostFault.NOT_VENTED
    assert passed_s <= 1.1 + period_s


@pytest.mark.parametrize("period_s", [0.1, 0.3, 0.7, 1.5])
def test_orders_in_a_fast_sequence_do_not_trip_a_board_that_follows(period_s):
    harness = InstrumentHarness.holding()
    for order in (VENT, HOLD_8) * 5:
        harness.write_ok(order)
        harness.run(period_s)
    harness.run(1.5)
    assert harness.instrument.faults.first == 0
    assert harness.state is BoardState.HOLDING


def test_samples_from_before_a_command_are_not_a_disagreement():
    harness = InstrumentHarness.holding(host_timeout_s=1.0)
    stopped_s = harness.now_s
    harness.now_s += 1.2  # the process was stopped while the board continued
    harness.instrument.tick(harness.now_s)
    for n in range(590):
        harness.instrument.process(RawSample(0, stopped_s + 0.002 * n, harness.sample()))
    harness.run(1.5)
    assert list(harness.instrument.faults) == [HostFault.LINK_LOST]


@pytest.mark.parametrize("mask", [1 << 15, 1 << 15 | 1 << 4])
def test_an_unknown_fault_of_a_newer_board_trips(mask):
    harness = InstrumentHarness.holding()
    harness.feed(faults=mask, fault=15)
    assert harness.snapshot().state == "tripped"
    assert not harness.commands_hold
    assert 15 in harness.snapshot().faults
    harness.write_ok(VENT)


def test_a_board_that_received_no_command_does_not_cause_a_disagreement():
    harness = InstrumentHarness.holding()
    harness.run_without_samples(1.5)
    harness.feed()  # still locked: the board has not received the vent command
    harness.run(0.5)
    assert list(harness.instrument.faults) == [HostFault.LINK_LOST]


class AnyTraffic(RuleBasedStateMachine):
    """Random requests, trips and missing samples. The rig holds only if the rules of arming were followed."""

    def __init__(self):
        super().__init__()
        self.harness = InstrumentHarness.zeroed()
        self.vent_seen = False  # a peer has vented, with no fault latched, since the start or the last trip
        self.last_mode = {}
        self.asked = False  # "hold" was accepted since the last vent

    def note_trip(self):
        if len(self.harness.instrument.faults):
            self.vent_seen = self.asked = False

    @rule(peer=st.sampled_from([PLC, ROBOT, WEB]), more=st.sampled_from([{}, SETPOINT, {"lease_s": 0.3}]))
    def vent(self, peer, more):
        self.note_trip()
        self.harness.write(VENT | more, peer)
        self.last_mode[peer] = "vent"
        self.vent_seen = not len(self.harness.instrument.faults)
        self.asked = False
        assert not self.harness.commands_hold

    @rule(
        peer=st.sampled_from([PLC, ROBOT, WEB]),
        more=st.sampled_from([{}, SETPOINT, {"lease_s": 0.3} | SETPOINT]),
    )
    def hold(self, peer, more):
        self.note_trip()
        accepted = self.harness.write(HOLD | more, peer) == "none"
        meant = self.asked or (self.vent_seen and self.last_mode.get(peer, "vent") == "vent")
        self.last_mode[peer] = "hold"
        assert meant or not accepted
        self.asked = self.asked or accepted

    @rule(peer=st.sampled_from([PLC, ROBOT]), lease_s=st.sampled_from([0.0, 0.3, 1.0]))
    def lease(self, peer, lease_s):
        self.harness.write({"lease_s": lease_s}, peer)

    @rule(code=st.sampled_from(["clear_faults", "zero_pressure", "restore_zero", "self_test", "new_balloon"]))
    def order(self, code):
        delayed = self.harness.instrument.command_monitor.vent_due  # a hold waits until the board has vented
        before = self.harness.commands_hold or (self.asked and delayed)
        self.harness.run_command(code)
        self.note_trip()
        assert before or not self.harness.commands_hold

    @rule(fault=st.sampled_from([*list(Fault)[1:], *HostFault]))
    def trip(self, fault):
        self.harness.instrument.trip(fault)
        self.note_trip()
        assert not self.harness.commands_hold

    @rule(fault=st.sampled_from(list(Fault)[1:]), lasts=st.booleans())
    def board_trips(self, fault, lasts):
        self.harness.latched.add(fault)
        if lasts:
            self.harness.causes.add(fault)
        self.harness.run(0.02)
        self.note_trip()

    @precondition(lambda self: self.harness.causes)
    @rule()
    def causes_go(self):
        self.harness.causes.clear()

    @rule(push_kpa=st.sampled_from([0.0, 1.0, 7.0, 12.0]))
    def press(self, push_kpa):
        self.harness.push_kpa = push_kpa

    @rule(seconds=st.sampled_from([0.01, 0.1, 0.5]))
    def samples(self, seconds):
        self.harness.run(seconds)
        self.note_trip()

    @rule(seconds=st.sampled_from([0.05, 0.2, 0.3, 1.0]))
    def silence(self, seconds):
        self.harness.run_without_samples(seconds)
        self.note_trip()

    @invariant()
    def holds_only_by_the_rules(self):
        instrument = self.harness.instrument
        if self.harness.commands_hold:
            waits = instrument.vent_pending and list(instrument.faults) == [HostFault.LEASE_EXPIRED]
            assert (self.asked and not len(instrument.faults)) or waits
            assert instrument.chain.zero.taken
            assert 2000 <= instrument.command().setpoint_pa <= 12000

    @invariant()
    def a_snapshot_can_always_be_taken(self):
        self.harness.snapshot()


TestAnyTraffic = AnyTraffic.TestCase
TestAnyTraffic.settings = settings(max_examples=60, stateful_step_count=25)
