"""Requests: judged whole, refused per peer, and a vent never refused."""

import math

import pytest

from instrument.faults import HostFault
from instrument.requests import SETPOINT_KPA
from instrument.rig.frames import BoardState, CommandFlag
from registers.map import BY_NAME
from tests.instrument.driving import HOLD, HOLD_8, KEY, PAGE, PLC, ROBOT, SETPOINT, VENT, Drive

LEASED = {"lease_s": 60.0}


def under_lease():
    return Drive.holding(ROBOT, LEASED)


def locked():
    drive = Drive.holding()
    object.__setattr__(drive.instrument.settings, "write_lock", True)
    return drive


def faulty():
    drive = Drive.holding()
    drive.instrument.trip(HostFault.SENSOR_LIMIT)
    return drive


def lost():
    return Drive.holding().silence(0.3)


def never_heard():
    return Drive.new()


SITUATIONS = [Drive.holding, under_lease, locked, faulty, lost, never_heard, Drive.ready]
BESIDES = [{}, SETPOINT, LEASED, {"reference_pressure_kpa": 1.0}, {"setpoint_requested_kpa": math.nan}, KEY]


@pytest.mark.parametrize("besides", BESIDES, ids=str)
@pytest.mark.parametrize("situation", SITUATIONS)
def test_a_vent_is_carried_out_by_anybody_whatever_else_is_asked(situation, besides):
    drive = situation()
    for peer in (PLC, ROBOT, PAGE):
        drive.write(VENT | besides, peer)
        assert not drive.inflates
        assert drive.see().mode == "vent"


@pytest.mark.parametrize("situation", SITUATIONS)
def test_a_vent_alone_is_accepted_from_anybody(situation):
    drive = situation()
    for peer in (PLC, ROBOT, PAGE):
        assert drive.write(VENT, peer) == "none"


@pytest.mark.parametrize("situation", [under_lease, locked])
def test_a_refused_request_changes_nothing_but_the_vent_in_it(situation):
    drive = situation()
    before = drive.see(PAGE)
    assert drive.write({"setpoint_requested_kpa": 3.0, "force_limit_n": 1.0, "lease_s": 1.0} | VENT) != "none"
    after = drive.see(PAGE)
    for name in ("setpoint_requested_kpa", "force_limit_n", "lease_s", "lease_holder", "command_sequence"):
        assert getattr(after, name) == getattr(before, name)


def test_one_refused_value_refuses_all_of_its_request():
    drive = Drive.holding()
    refused = {"reference_pressure_kpa": 1.0, "setpoint_requested_kpa": 5.0, "force_limit_n": 1.0}
    assert drive.write(refused) == "state"
    seen = drive.see()
    assert (seen.setpoint_requested_kpa, seen.force_limit_n, seen.reference_pressure_kpa) == (8.0, 5.0, 0.0)


def test_a_refusal_is_the_peers_own_and_kept_until_its_next_accepted_write():
    drive = Drive.zeroed()
    assert drive.write(HOLD_8, PLC) == "state"
    drive.must(SETPOINT, ROBOT)
    drive.run(5.0)
    assert (drive.see(PLC).refusal, drive.see(ROBOT).refusal) == ("state", "none")
    drive.must(SETPOINT, PLC)
    assert drive.see(PLC).refusal == "none"


def test_a_refusal_is_replaced_by_the_next_one():
    drive = Drive.zeroed()
    drive.write(HOLD_8)
    drive.instrument.trip(HostFault.SENSOR_LIMIT)
    drive.write(HOLD_8)
    assert drive.see().refusal == "fault_latched"


def test_thousands_of_peers_are_not_remembered_for_ever_and_the_busy_one_is():
    drive = Drive.zeroed()
    for number in range(3000):
        assert drive.write(HOLD_8, PLC) == "state"
        drive.see(("modbus_tcp", str(number)))
    assert drive.see(PLC).refusal == "state"
    assert len(drive.instrument.peers._memories) <= 256


def test_a_refusal_is_kept_while_255_others_write():
    drive = Drive.zeroed()
    assert drive.write(HOLD_8, PLC) == "state"
    for number in range(255):
        drive.must(SETPOINT, ("modbus_tcp", str(number)))
    assert drive.see(PLC).refusal == "state"


def test_however_many_others_write_a_hold_without_end_never_undoes_a_vent():
    drive = Drive.holding()
    drive.must(VENT, PAGE)
    drive.run(1.5)
    for number in range(300):
        drive.must(VENT, ("modbus_tcp", str(number)))
    assert drive.write(HOLD) == "state"
    assert not drive.inflates


def test_where_more_hold_than_can_be_remembered_the_unknown_have_to_vent_first():
    drive = Drive.ready()
    drive.must(SETPOINT)
    for number in range(300):
        drive.write(HOLD, ("modbus_tcp", str(number)))
    drive.must(VENT)
    drive.run(1.5)
    stranger = ("modbus_tcp", "stranger")
    assert [drive.write(HOLD, ("modbus_tcp", str(n))) for n in (0, 299)] == ["state", "state"]
    assert drive.write(HOLD, stranger) == "state"
    drive.must(VENT, stranger)
    drive.must(HOLD, stranger)


def test_with_the_write_lock_only_a_vent_passes():
    drive = Drive.ready(write_lock=True)
    for request in (SETPOINT, HOLD_8, LEASED, KEY):
        assert drive.write(request) == "write_lock"
    assert "write_lock" in drive.see().status
    drive.must(VENT)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 0.0, -1.0, 1.999, 12.001, 1e9, 1e-40])
def test_no_broken_setpoint_reaches_the_board_even_where_a_bus_let_it_pass(value):
    for drive in (Drive.ready(), Drive.holding()):
        before = drive.instrument.command()
        assert drive.write({"setpoint_requested_kpa": value}) != "none"
        assert drive.write(HOLD_8 | {"setpoint_requested_kpa": value}) != "none"
        assert drive.instrument.command() == before


def test_the_core_and_the_map_agree_on_the_span_of_the_setpoint():
    register = BY_NAME["setpoint_requested"]
    assert (register.low, register.high) == SETPOINT_KPA


class TestReferencePressure:
    """Insufflation around the balloon."""

    def test_it_is_taken_when_vented(self):
        drive = Drive.zeroed()
        drive.must({"reference_pressure_kpa": 1.5})
        assert drive.instrument.chain.reference_kpa == 1.5

    def test_it_is_refused_when_inflated_and_says_so_when_pressed(self):
        drive = Drive.holding()
        assert drive.write({"reference_pressure_kpa": 1.5}) == "state"
        drive.push_kpa = 1.0
        drive.run(0.5)
        assert drive.write({"reference_pressure_kpa": 1.5}) == "in_contact"
        assert drive.instrument.chain.reference_kpa == 0.0

    def test_it_is_refused_when_nobody_knows_whether_the_rig_is_vented(self):
        drive = Drive.zeroed().silence(0.3)
        assert drive.write({"reference_pressure_kpa": 1.5}) == "state"

    def test_it_shifts_what_the_model_sees_and_not_the_gauge(self):
        plain, shifted = Drive.ready(), Drive.ready()
        shifted.must({"reference_pressure_kpa": 2.0})
        for drive in (plain, shifted):
            drive.must(HOLD_8)
            drive.run(1.0)
        assert shifted.see().pressure_kpa == plain.see().pressure_kpa
        balloon = plain.instrument.settings.chain.balloon
        assert shifted.see().radius_mm == pytest.approx(balloon.radius_mm(6.0), abs=2e-3)


def test_a_setpoint_written_in_contact_is_passed_on_with_the_word_that_there_is_a_contact():
    drive = Drive.holding()
    assert not drive.instrument.command().flags & CommandFlag.IN_CONTACT
    drive.push_kpa = 1.0
    drive.run(0.5)
    drive.must({"setpoint_requested_kpa": 6.0})
    command = drive.instrument.command()
    assert command.flags & CommandFlag.IN_CONTACT
    assert command.setpoint_pa == 6000
    drive.feed(setpoint_pa=8000, state=BoardState.HOLDING)  # the board waits
    assert drive.see().setpoint_kpa == 8.0
    assert drive.see().setpoint_requested_kpa == 6.0


def test_the_force_limit_raises_an_alarm_and_vents_only_if_so_configured():
    for vents in (False, True):
        drive = Drive.holding(vent_on_force_limit=vents)
        drive.must({"force_limit_n": 0.2})
        assert "force_limit" not in drive.see().status
        drive.push_kpa = 1.0
        drive.run(0.6, None if vents else lambda drive=drive: "force_limit" in drive.see().status)
        assert drive.inflates is not vents
