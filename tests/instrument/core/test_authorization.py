"""Tests of write authorization: a write is accepted or rejected completely; a vent is always executed."""

import math

import pytest

from pneuforce.instrument.core.authorization import SETPOINT_KPA
from pneuforce.instrument.core.faults import HostFault
from pneuforce.protocol.frames import BoardState, CommandFlag
from pneuforce.registers.map import BY_NAME
from tests.instrument.instrument_harness import (
    HOLD,
    HOLD_8,
    KEY,
    PLC,
    ROBOT,
    SETPOINT,
    VENT,
    WEB,
    InstrumentHarness,
)

LEASED = {"lease_s": 60.0}


def under_lease():
    return InstrumentHarness.holding(ROBOT, LEASED)


def locked():
    harness = InstrumentHarness.holding()
    object.__setattr__(harness.instrument.settings, "write_protect", True)
    return harness


def faulty():
    harness = InstrumentHarness.holding()
    harness.instrument.trip(HostFault.SENSOR_LIMIT)
    return harness


def lost():
    return InstrumentHarness.holding().run_without_samples(0.3)


def never_heard():
    return InstrumentHarness.new()


SITUATIONS = [
    InstrumentHarness.holding,
    under_lease,
    locked,
    faulty,
    lost,
    never_heard,
    InstrumentHarness.ready,
]
BESIDES = [{}, SETPOINT, LEASED, {"reference_pressure_kpa": 1.0}, {"setpoint_requested_kpa": math.nan}, KEY]


@pytest.mark.parametrize("besides", BESIDES, ids=str)
@pytest.mark.parametrize("situation", SITUATIONS)
def test_a_vent_is_executed_for_every_peer_whatever_else_is_written(situation, besides):
    harness = situation()
    for peer in (PLC, ROBOT, WEB):
        harness.write(VENT | besides, peer)
        assert not harness.commands_hold
        assert harness.snapshot().mode == "vent"


@pytest.mark.parametrize("situation", SITUATIONS)
def test_a_vent_alone_is_accepted_from_every_peer(situation):
    harness = situation()
    for peer in (PLC, ROBOT, WEB):
        assert harness.write(VENT, peer) == "none"


@pytest.mark.parametrize("situation", [under_lease, locked])
def test_a_rejected_write_changes_nothing_except_by_its_vent(situation):
    harness = situation()
    before = harness.snapshot(WEB)
    assert (
        harness.write({"setpoint_requested_kpa": 3.0, "force_limit_n": 1.0, "lease_s": 1.0} | VENT) != "none"
    )
    after = harness.snapshot(WEB)
    for name in ("setpoint_requested_kpa", "force_limit_n", "lease_s", "lease_holder", "command_sequence"):
        assert getattr(after, name) == getattr(before, name)


def test_one_rejected_value_rejects_the_complete_write():
    harness = InstrumentHarness.holding()
    refused = {"reference_pressure_kpa": 1.0, "setpoint_requested_kpa": 5.0, "force_limit_n": 1.0}
    assert harness.write(refused) == "state"
    seen = harness.snapshot()
    assert (seen.setpoint_requested_kpa, seen.force_limit_n, seen.reference_pressure_kpa) == (8.0, 5.0, 0.0)


def test_each_peer_has_its_own_reject_reason_until_its_next_accepted_write():
    harness = InstrumentHarness.zeroed()
    assert harness.write(HOLD_8, PLC) == "state"
    harness.write_ok(SETPOINT, ROBOT)
    harness.run(5.0)
    assert (harness.snapshot(PLC).reject_reason, harness.snapshot(ROBOT).reject_reason) == ("state", "none")
    harness.write_ok(SETPOINT, PLC)
    assert harness.snapshot(PLC).reject_reason == "none"


def test_a_reject_reason_is_replaced_by_the_next():
    harness = InstrumentHarness.zeroed()
    harness.write(HOLD_8)
    harness.instrument.trip(HostFault.SENSOR_LIMIT)
    harness.write(HOLD_8)
    assert harness.snapshot().reject_reason == "fault_latched"


def test_only_the_most_recent_of_thousands_of_peers_are_stored():
    harness = InstrumentHarness.zeroed()
    for number in range(3000):
        assert harness.write(HOLD_8, PLC) == "state"
        harness.snapshot(("modbus_tcp", str(number)))
    assert harness.snapshot(PLC).reject_reason == "state"
    assert len(harness.instrument.peers._records) <= 256


def test_a_reject_reason_is_stored_while_255_other_peers_write():
    harness = InstrumentHarness.zeroed()
    assert harness.write(HOLD_8, PLC) == "state"
    for number in range(255):
        harness.write_ok(SETPOINT, ("modbus_tcp", str(number)))
    assert harness.snapshot(PLC).reject_reason == "state"


def test_a_repeated_hold_never_undoes_a_vent_however_many_peers_write():
    harness = InstrumentHarness.holding()
    harness.write_ok(VENT, WEB)
    harness.run(1.5)
    for number in range(300):
        harness.write_ok(VENT, ("modbus_tcp", str(number)))
    assert harness.write(HOLD) == "state"
    assert not harness.commands_hold


def test_unknown_peers_must_vent_first_after_the_table_of_peers_was_full():
    harness = InstrumentHarness.ready()
    harness.write_ok(SETPOINT)
    for number in range(300):
        harness.write(HOLD, ("modbus_tcp", str(number)))
    harness.write_ok(VENT)
    harness.run(1.5)
    stranger = ("modbus_tcp", "stranger")
    assert [harness.write(HOLD, ("modbus_tcp", str(n))) for n in (0, 299)] == ["state", "state"]
    assert harness.write(HOLD, stranger) == "state"
    harness.write_ok(VENT, stranger)
    harness.write_ok(HOLD, stranger)


def test_with_write_protection_only_a_vent_is_accepted():
    harness = InstrumentHarness.ready(write_protect=True)
    for request in (SETPOINT, HOLD_8, LEASED, KEY):
        assert harness.write(request) == "write_protect"
    assert "write_protect" in harness.snapshot().status
    harness.write_ok(VENT)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 0.0, -1.0, 1.999, 12.001, 1e9, 1e-40])
def test_no_invalid_setpoint_reaches_the_board_even_if_a_bus_accepts_it(value):
    for harness in (InstrumentHarness.ready(), InstrumentHarness.holding()):
        before = harness.instrument.command()
        assert harness.write({"setpoint_requested_kpa": value}) != "none"
        assert harness.write(HOLD_8 | {"setpoint_requested_kpa": value}) != "none"
        assert harness.instrument.command() == before


def test_the_core_and_the_map_agree_on_the_span_of_the_setpoint():
    register = BY_NAME["setpoint_requested"]
    assert (register.low, register.high) == SETPOINT_KPA


class TestReferencePressure:
    """Tests of the reference pressure, which is the pressure of the gas around the balloon."""

    def test_the_reference_pressure_is_accepted_when_vented(self):
        harness = InstrumentHarness.zeroed()
        harness.write_ok({"reference_pressure_kpa": 1.5})
        assert harness.instrument.chain.reference_kpa == 1.5

    def test_it_is_rejected_when_inflated_and_the_reason_differs_in_contact(self):
        harness = InstrumentHarness.holding()
        assert harness.write({"reference_pressure_kpa": 1.5}) == "state"
        harness.push_kpa = 1.0
        harness.run(0.5)
        assert harness.write({"reference_pressure_kpa": 1.5}) == "in_contact"
        assert harness.instrument.chain.reference_kpa == 0.0

    def test_it_is_rejected_if_the_vent_is_not_verified(self):
        harness = InstrumentHarness.zeroed().run_without_samples(0.3)
        assert harness.write({"reference_pressure_kpa": 1.5}) == "state"

    def test_it_shifts_the_pressure_of_the_model_but_not_the_gauge_pressure(self):
        plain, shifted = InstrumentHarness.ready(), InstrumentHarness.ready()
        shifted.write_ok({"reference_pressure_kpa": 2.0})
        for harness in (plain, shifted):
            harness.write_ok(HOLD_8)
            harness.run(1.0)
        assert shifted.snapshot().pressure_kpa == plain.snapshot().pressure_kpa
        balloon = plain.instrument.settings.chain.balloon
        assert shifted.snapshot().radius_mm == pytest.approx(balloon.radius_mm(6.0), abs=2e-3)


REFERENCE = {"reference_pressure_kpa": 1.5}


class TestReferenceTimeout:
    """Tests of `reference_timeout_s`: the force is valid only with a recent reference pressure."""

    def holding(self):
        """Return a harness with a timeout of 1 s that holds the balloon in a cavity at 1.5 kPa."""
        harness = InstrumentHarness.ready(reference_timeout_s=1.0)
        harness.write_ok(HOLD_8 | REFERENCE)
        return harness.renew(1.0, request=REFERENCE)

    def is_valid(self, harness):
        status = harness.snapshot().status
        assert math.isfinite(harness.snapshot().force_n) is ("force_valid" in status)
        assert ("baseline_old" in status) is ("force_valid" not in status)
        return "force_valid" in status

    def test_without_a_timeout_the_force_is_valid_without_a_reference_pressure(self):
        assert self.is_valid(InstrumentHarness.holding())

    def test_without_a_reference_pressure_the_force_is_not_valid(self):
        assert not self.is_valid(InstrumentHarness.holding(reference_timeout_s=1.0))

    @pytest.mark.parametrize("push_kpa", [0.0, 1.0])
    def test_the_force_is_valid_only_for_this_time_after_a_write(self, push_kpa):
        harness = self.holding()
        harness.push_kpa = push_kpa
        harness.run(0.9)
        assert self.is_valid(harness)
        harness.run(0.2)
        assert not self.is_valid(harness)
        assert ("in_contact" in harness.snapshot().status) is (push_kpa > 0)
        harness.write_ok(REFERENCE)
        harness.run(0.1)
        assert self.is_valid(harness)

    def test_the_force_alarm_does_not_need_a_reference_pressure(self):
        harness = self.holding()
        harness.push_kpa = 4.0
        harness.write_ok({"force_limit_n": 0.5})
        harness.run(2.0)
        assert "force_high_alarm" in harness.snapshot().status

    @pytest.mark.parametrize("push_kpa", [0.0, 1.0])
    def test_a_changed_reference_pressure_of_an_inflated_balloon_gives_no_force_until_a_vent(self, push_kpa):
        harness = self.holding()
        harness.push_kpa = push_kpa
        changed = {"reference_pressure_kpa": 1.7}
        harness.renew(0.5, request=changed)
        assert not self.is_valid(harness)
        assert harness.instrument.chain.reference_kpa == 1.5
        harness.push_kpa = 0.0
        harness.renew(0.5, request=REFERENCE)
        assert not self.is_valid(harness)
        harness.write_ok(VENT)
        harness.renew(1.0, request=changed)
        harness.write_ok(HOLD_8)
        harness.renew(1.0, request=changed)
        assert self.is_valid(harness)
        assert harness.instrument.chain.reference_kpa == 1.7

    def test_a_small_change_of_the_reference_pressure_has_no_effect(self):
        harness = self.holding()
        for reference_kpa in (1.45, 1.55):
            harness.renew(0.5, request={"reference_pressure_kpa": reference_kpa})
            assert self.is_valid(harness)
        assert harness.instrument.chain.reference_kpa == 1.5


def test_a_setpoint_in_contact_is_sent_with_the_contact_flag():
    harness = InstrumentHarness.holding()
    assert not harness.instrument.command().flags & CommandFlag.IN_CONTACT
    harness.push_kpa = 1.0
    harness.run(0.5)
    harness.write_ok({"setpoint_requested_kpa": 6.0})
    command = harness.instrument.command()
    assert command.flags & CommandFlag.IN_CONTACT
    assert command.setpoint_pa == 6000
    harness.feed(setpoint_pa=8000, state=BoardState.HOLDING)  # the board waits until the contact ends
    assert harness.snapshot().setpoint_kpa == 8.0
    assert harness.snapshot().setpoint_requested_kpa == 6.0


def test_the_force_limit_raises_an_alarm_and_vents_only_if_configured():
    for vents in (False, True):
        harness = InstrumentHarness.holding(vent_on_force_limit=vents)
        harness.write_ok({"force_limit_n": 0.2})
        assert "force_high_alarm" not in harness.snapshot().status
        harness.push_kpa = 1.0
        harness.run(
            0.6, None if vents else lambda harness=harness: "force_high_alarm" in harness.snapshot().status
        )
        assert harness.commands_hold is not vents
