"""Leases: whoever commands must keep saying so."""

import pytest

from instrument.faults import HostFault
from instrument.rig.frames import Fault
from tests.instrument.driving import HOLD, HOLD_8, PAGE, PLC, ROBOT, SETPOINT, VENT, Drive

LEASED = {"lease_s": 0.5}


def test_the_writer_holds_it_and_the_snapshot_tells_who_and_how_long():
    drive = Drive.ready()
    drive.must({"lease_s": 0.5}, ROBOT)
    drive.now_s += 0.2
    seen = drive.see()
    assert (seen.lease_s, seen.lease_holder) == (0.5, "can")
    assert seen.lease_left_s == pytest.approx(0.3)


@pytest.mark.parametrize(
    "request_", [SETPOINT, {"force_limit_n": 3.0}, HOLD, LEASED, {"command_key": 0x5046}]
)
def test_every_accepted_write_of_the_holder_renews_it(request_):
    drive = Drive.holding(request=LEASED).renew(1.5, PLC, request_)
    assert drive.inflates
    assert drive.see().first_fault == 0


def test_a_refused_write_does_not_renew_it():
    drive = Drive.ready()
    drive.must(LEASED)
    for _ in range(3):
        drive.run(0.2)
        drive.write({"reference_pressure_kpa": 0.0} | HOLD)  # there is no setpoint
    assert "lease_expired" in drive.see().status


@pytest.mark.parametrize("request_", [SETPOINT, HOLD_8, LEASED, {"lease_s": 0.0}, {"force_limit_n": 1.0}])
def test_another_cannot_write_or_take_it_over(request_):
    drive = Drive.holding(request=LEASED)
    before = drive.see(PLC)
    assert drive.write(request_, ROBOT) == "lease"
    assert drive.see(PLC) == before
    assert drive.see(ROBOT).refusal == "lease"


def test_another_may_always_vent_and_does_not_renew_it_by_that():
    drive = Drive.holding(request=LEASED)
    drive.must(VENT, ROBOT)
    drive.run(0.1)
    assert not drive.inflates
    drive.must(VENT, ROBOT)
    drive.run(0.5)
    assert "lease_expired" in drive.see().status


def test_the_same_address_keeps_it_and_may_end_it():
    drive = Drive.holding(request=LEASED)
    drive.must({"lease_s": 0.0}, ("modbus_tcp", PLC[1]))
    assert drive.see().lease_holder == "none"
    drive.run(2.0)
    assert drive.inflates
    drive.must(SETPOINT, ROBOT)


def test_run_out_while_free_it_vents_and_trips():
    drive = Drive.holding(request=LEASED)
    drive.run(0.5)
    assert drive.inflates
    drive.run(0.05)
    assert not drive.inflates
    seen = drive.see()
    assert "lease_expired" in seen.status
    assert (seen.state, seen.first_fault, seen.lease_holder) == ("tripped", HostFault.LEASE_EXPIRED, "none")


def test_run_out_while_inflating_it_vents_at_once():
    drive = Drive.ready()
    drive.obeys = False
    drive.must(HOLD_8 | LEASED)
    drive.run(0.55)
    assert not drive.inflates


def pressed_and_run_out(**settings):
    drive = Drive.holding(request=LEASED, **settings)
    drive.push_kpa = 1.0
    drive.renew(0.5)
    assert "in_contact" in drive.see().status
    return drive.run(0.6)


def test_run_out_in_contact_the_balloon_stays_locked_until_the_contact_ends():
    drive = pressed_and_run_out()
    seen = drive.see()
    assert drive.inflates
    assert "lease_expired" in seen.status
    assert (seen.state, seen.setpoint_kpa) == ("holding", 8.0)
    assert seen.force_n > 0.1
    drive.push_kpa = 0.0
    drive.run(1.0)
    assert not drive.inflates
    assert drive.see().state == "tripped"


def test_run_out_in_contact_the_balloon_is_vented_after_five_seconds_at_most():
    drive = pressed_and_run_out()
    drive.run(4.8)
    assert drive.inflates
    drive.run(0.2)
    assert not drive.inflates


def test_the_grace_in_contact_cannot_be_lengthened():
    drive = pressed_and_run_out()
    for _ in range(50):
        assert drive.write(HOLD_8 | LEASED) == "fault_latched"
        drive.run(0.1)
    assert not drive.inflates


def test_a_setpoint_written_in_the_grace_is_stored_and_not_acted_on():
    drive = pressed_and_run_out()
    drive.must({"setpoint_requested_kpa": 11.0})
    assert drive.instrument.command().setpoint_pa == 8000
    assert drive.see().setpoint_requested_kpa == 11.0


def test_a_vent_ends_the_grace_at_once():
    drive = pressed_and_run_out()
    drive.must(VENT, PAGE)
    assert not drive.inflates


@pytest.mark.parametrize("fault", [HostFault.PRESSURE_LIMIT, HostFault.BOARD_RESET, Fault.BURST])
def test_any_other_fault_ends_the_grace_at_once(fault):
    drive = pressed_and_run_out()
    drive.instrument.trip(fault)
    assert not drive.inflates


def test_silence_ends_the_grace():
    drive = pressed_and_run_out()
    drive.silence(0.3)
    assert not drive.inflates


def test_a_clear_in_the_grace_is_refused_because_it_would_move_a_valve():
    drive = pressed_and_run_out()
    assert drive.order("clear_faults") == ("failed", "in_contact")
    assert drive.inflates
    assert "lease_expired" in drive.see().status


def test_a_write_that_comes_after_the_time_does_not_bring_it_back():
    drive = Drive.holding(request=LEASED)
    drive.now_s += 0.501  # no tick has looked yet
    assert drive.write(HOLD_8) != "none"
    assert drive.see().lease_holder == "none"
    assert "lease_expired" in drive.see().status


class TestDemanded:
    """The configuration demands a lease."""

    def test_hold_is_refused_without_one(self):
        drive = Drive.ready(lease_demanded=True)
        assert drive.write(HOLD_8) == "lease"
        drive.must(VENT)
        drive.must(HOLD_8 | LEASED)

    def test_one_taken_before_will_do(self):
        drive = Drive.ready(lease_demanded=True)
        drive.must(LEASED)
        drive.must(HOLD_8)

    def test_it_cannot_be_ended_while_holding(self):
        drive = Drive.holding(request=LEASED, lease_demanded=True)
        assert drive.write({"lease_s": 0.0}) == "lease"
        assert drive.write(HOLD_8 | {"lease_s": 0.0}) == "lease"
        assert drive.see().lease_holder == "modbus_tcp"

    def test_it_can_be_ended_with_a_vent(self):
        drive = Drive.holding(request={"lease_s": 5.0}, lease_demanded=True)
        drive.must(VENT | {"lease_s": 0.0})
        assert drive.see().lease_holder == "none"

    def test_the_rest_needs_none(self):
        drive = Drive.ready(lease_demanded=True)
        drive.must(SETPOINT)
        drive.must(VENT)


def test_a_lost_can_master_vents_and_trips_a_free_balloon_at_once():
    drive = Drive.holding(ROBOT)
    drive.instrument.abandoned(HostFault.CAN_MASTER_LOST, drive.now_s)
    drive.run(0.05)
    assert not drive.inflates
    assert (drive.see().state, drive.see().first_fault) == ("tripped", HostFault.CAN_MASTER_LOST)


def test_a_lost_can_master_leaves_a_pressed_balloon_locked_for_five_seconds_at_most():
    drive = Drive.holding(ROBOT)
    drive.push_kpa = 1.0
    drive.run(0.5)
    drive.instrument.abandoned(HostFault.CAN_MASTER_LOST, drive.now_s)
    drive.run(4.8)
    assert drive.inflates
    drive.run(0.3)
    assert not drive.inflates


def test_a_master_lost_in_the_grace_of_a_lease_neither_ends_nor_lengthens_it():
    drive = pressed_and_run_out()
    drive.run(2.0)
    drive.instrument.abandoned(HostFault.CAN_MASTER_LOST, drive.now_s)
    drive.run(2.8)
    assert drive.inflates
    drive.run(0.2)
    assert not drive.inflates
