"""Tests of leases: a peer that has a lease must renew the lease in time."""

import pytest

from pneuforce.instrument.core.faults import HostFault
from pneuforce.instrument.core.lease import Lease
from pneuforce.protocol.frames import Fault
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

LEASED = {"lease_s": 0.5}


def test_a_lease_lasts_for_its_duration():
    lease = Lease()
    lease.take(PLC, 0.5, now_s=10.0)
    assert lease.left_s(10.2) == pytest.approx(0.3)
    assert not lease.expire(10.5)
    assert lease.expire(10.51)


def test_the_snapshot_shows_holder_and_time_left():
    harness = InstrumentHarness.ready()
    harness.write_ok({"lease_s": 0.5}, ROBOT)
    harness.now_s += 0.2
    seen = harness.snapshot()
    assert (seen.lease_s, seen.lease_holder) == (0.5, "can")
    assert seen.lease_left_s == pytest.approx(0.3)


@pytest.mark.parametrize(
    "request_", [SETPOINT, {"force_limit_n": 3.0}, HOLD, LEASED, {"command_key": 0x5046}]
)
def test_every_accepted_write_of_the_holder_renews_the_lease(request_):
    harness = InstrumentHarness.holding(request=LEASED).renew(1.5, PLC, request_)
    assert harness.commands_hold
    assert harness.snapshot().first_out_fault == 0


def test_a_rejected_write_does_not_renew_the_lease():
    harness = InstrumentHarness.ready()
    harness.write_ok(LEASED)
    for _ in range(3):
        harness.run(0.2)
        harness.write({"reference_pressure_kpa": 0.0} | HOLD)  # rejected, because there is no setpoint
    assert "lease_expired" in harness.snapshot().status


@pytest.mark.parametrize("request_", [SETPOINT, HOLD_8, LEASED, {"lease_s": 0.0}, {"force_limit_n": 1.0}])
def test_another_peer_cannot_write_or_take_the_lease(request_):
    harness = InstrumentHarness.holding(request=LEASED)
    before = harness.snapshot(PLC)
    assert harness.write(request_, ROBOT) == "lease"
    assert harness.snapshot(PLC) == before
    assert harness.snapshot(ROBOT).reject_reason == "lease"


def test_another_peer_can_always_vent_without_renewing_the_lease():
    harness = InstrumentHarness.holding(request=LEASED)
    harness.write_ok(VENT, ROBOT)
    harness.run(0.1)
    assert not harness.commands_hold
    harness.write_ok(VENT, ROBOT)
    harness.run(0.5)
    assert "lease_expired" in harness.snapshot().status


def test_the_same_address_keeps_the_lease_and_can_end_it():
    harness = InstrumentHarness.holding(request=LEASED)
    harness.write_ok({"lease_s": 0.0}, ("modbus_tcp", PLC[1]))
    assert harness.snapshot().lease_holder == "none"
    harness.run(2.0)
    assert harness.commands_hold
    harness.write_ok(SETPOINT, ROBOT)


def test_expiry_without_contact_vents_and_trips():
    harness = InstrumentHarness.holding(request=LEASED)
    harness.run(0.5)
    assert harness.commands_hold
    harness.run(0.05)
    assert not harness.commands_hold
    seen = harness.snapshot()
    assert "lease_expired" in seen.status
    assert (seen.state, seen.first_out_fault, seen.lease_holder) == (
        "tripped",
        HostFault.LEASE_EXPIRED,
        "none",
    )


def test_expiry_during_inflation_vents_at_once():
    harness = InstrumentHarness.ready()
    harness.follows_commands = False
    harness.write_ok(HOLD_8 | LEASED)
    harness.run(0.55)
    assert not harness.commands_hold


def pressed_and_run_out(**settings):
    harness = InstrumentHarness.holding(request=LEASED, **settings)
    harness.push_kpa = 1.0
    harness.renew(0.5)
    assert "in_contact" in harness.snapshot().status
    return harness.run(0.6)


def test_after_expiry_in_contact_the_balloon_stays_locked_until_the_contact_ends():
    harness = pressed_and_run_out()
    seen = harness.snapshot()
    assert harness.commands_hold
    assert "lease_expired" in seen.status
    assert (seen.state, seen.setpoint_kpa) == ("holding", 8.0)
    assert seen.force_n > 0.1
    harness.push_kpa = 0.0
    harness.run(1.0)
    assert not harness.commands_hold
    assert harness.snapshot().state == "tripped"


def test_the_log_says_that_a_contact_delays_the_trip(caplog):
    harness = pressed_and_run_out()
    delayed = list(caplog.messages)
    harness.push_kpa = 0.0
    harness.run(1.0)
    tripped = [message for message in caplog.messages if message.startswith("tripped")]
    assert not any(message.startswith("tripped") for message in delayed)
    assert "when the contact ends" in delayed[-1]
    assert len(tripped) == 1
    assert "lease expired (fault 32)" in tripped[0]


@pytest.mark.parametrize("end", ["vent", "fault"])
def test_the_log_names_a_trip_that_ends_the_delay(end, caplog):
    harness = pressed_and_run_out()
    if end == "vent":
        harness.write_ok(VENT, WEB)
    else:
        harness.instrument.trip(HostFault.BOARD_RESET)
    assert sum(message.startswith("tripped") for message in caplog.messages) == 1


def test_after_expiry_in_contact_the_balloon_is_vented_within_five_seconds():
    harness = pressed_and_run_out()
    harness.run(4.8)
    assert harness.commands_hold
    harness.run(0.2)
    assert not harness.commands_hold


def test_the_delay_of_the_vent_cannot_be_extended():
    harness = pressed_and_run_out()
    for _ in range(50):
        assert harness.write(HOLD_8 | LEASED) == "fault_latched"
        harness.run(0.1)
    assert not harness.commands_hold


def test_a_setpoint_written_during_the_delay_is_stored_without_effect():
    harness = pressed_and_run_out()
    harness.write_ok({"setpoint_requested_kpa": 11.0})
    assert harness.instrument.command().setpoint_pa == 8000
    assert harness.snapshot().setpoint_requested_kpa == 11.0


def test_a_vent_ends_the_delay_at_once():
    harness = pressed_and_run_out()
    harness.write_ok(VENT, WEB)
    assert not harness.commands_hold


@pytest.mark.parametrize("fault", [HostFault.PRESSURE_LIMIT, HostFault.BOARD_RESET, Fault.BURST])
def test_any_other_fault_ends_the_delay_at_once(fault):
    harness = pressed_and_run_out()
    harness.instrument.trip(fault)
    assert not harness.commands_hold


def test_missing_samples_end_the_delay():
    harness = pressed_and_run_out()
    harness.run_without_samples(0.3)
    assert not harness.commands_hold


def test_a_clear_during_the_delay_is_rejected_because_it_would_move_a_valve():
    harness = pressed_and_run_out()
    assert harness.run_command("clear_faults") == ("failed", "in_contact")
    assert harness.commands_hold
    assert "lease_expired" in harness.snapshot().status


def test_a_late_write_does_not_restore_the_lease():
    harness = InstrumentHarness.holding(request=LEASED)
    harness.run(0.498)
    harness.now_s += 0.004  # before the next tick
    assert harness.write(HOLD_8) != "none"
    assert harness.snapshot().lease_holder == "none"
    assert "lease_expired" in harness.snapshot().status


class TestDemanded:
    """Tests of a configuration that requires a lease."""

    def test_hold_is_rejected_without_a_lease(self):
        harness = InstrumentHarness.ready(lease_required=True)
        assert harness.write(HOLD_8) == "lease"
        harness.write_ok(VENT)
        harness.write_ok(HOLD_8 | LEASED)

    def test_a_lease_that_was_taken_before_the_hold_is_sufficient(self):
        harness = InstrumentHarness.ready(lease_required=True)
        harness.write_ok(LEASED)
        harness.write_ok(HOLD_8)

    def test_the_lease_cannot_be_ended_while_holding(self):
        harness = InstrumentHarness.holding(request=LEASED, lease_required=True)
        assert harness.write({"lease_s": 0.0}) == "lease"
        assert harness.write(HOLD_8 | {"lease_s": 0.0}) == "lease"
        assert harness.snapshot().lease_holder == "modbus_tcp"

    def test_the_lease_can_be_ended_with_a_vent(self):
        harness = InstrumentHarness.holding(request={"lease_s": 5.0}, lease_required=True)
        harness.write_ok(VENT | {"lease_s": 0.0})
        assert harness.snapshot().lease_holder == "none"

    def test_other_writes_need_no_lease(self):
        harness = InstrumentHarness.ready(lease_required=True)
        harness.write_ok(SETPOINT)
        harness.write_ok(VENT)


def test_a_lost_can_master_vents_and_trips_a_free_balloon_at_once():
    harness = InstrumentHarness.holding(ROBOT)
    harness.instrument.trip_after_contact(HostFault.CAN_MASTER_LOST, harness.now_s)
    harness.run(0.05)
    assert not harness.commands_hold
    assert (harness.snapshot().state, harness.snapshot().first_out_fault) == (
        "tripped",
        HostFault.CAN_MASTER_LOST,
    )


def test_a_lost_can_master_leaves_a_pressed_balloon_locked_for_five_seconds_at_most():
    harness = InstrumentHarness.holding(ROBOT)
    harness.push_kpa = 1.0
    harness.run(0.5)
    harness.instrument.trip_after_contact(HostFault.CAN_MASTER_LOST, harness.now_s)
    harness.run(4.8)
    assert harness.commands_hold
    harness.run(0.3)
    assert not harness.commands_hold


def test_a_lost_can_master_neither_ends_nor_extends_the_delay():
    harness = pressed_and_run_out()
    harness.run(2.0)
    harness.instrument.trip_after_contact(HostFault.CAN_MASTER_LOST, harness.now_s)
    harness.run(2.8)
    assert harness.commands_hold
    harness.run(0.2)
    assert not harness.commands_hold
