"""Tests of the CAN receiver with single frames: validity, age, counters, and frames of other nodes."""

import math
import time
from types import SimpleNamespace

import pytest

from pneuforce import State, Status
from pneuforce.client.can_receiver import CanReceiver
from pneuforce.client.latest_sample import LatestSample
from pneuforce.registers.can.frames import (
    COMMAND,
    EMERGENCY,
    FORCE,
    HEARTBEAT,
    IDENTITY,
    STATE,
    STATUS_FRAME,
    encode,
)
from pneuforce.registers.can.wire import CanFrame

VALUES = SimpleNamespace(
    force_n=1.5,
    force_std_n=0.1,
    pressure_kpa=8.5,
    status=frozenset({"holding", "force_valid", "in_contact"}),
    state="holding",
    setpoint_kpa=8.0,
    baseline_pressure_kpa=8.0,
    radius_mm=8.2,
    peak_force_n=math.nan,
    reject_reason="none",
    contact_counter=1,
    sample_counter=1,
    map_hash=7,
    serial_number=1,
    active_fault_count=1,
)


def frame(definition, node_id=5, **values):
    data = encode(definition, SimpleNamespace(**(vars(VALUES) | values)), **values)
    return CanFrame(definition.base_id + node_id, data)


def force(counter, **values):
    return frame(FORCE, counter=counter, **values)


@pytest.fixture
def receiver():
    receiver = CanReceiver(5, 0.2)
    for each in (force(255), frame(STATE), frame(STATUS_FRAME), frame(IDENTITY)):
        receiver.receive(each)
    return receiver


def test_the_frames_are_combined(receiver):
    measurement = receiver.measurement()
    assert (measurement.force_n, measurement.force_std_n) == (1.5, 0.1)
    assert (measurement.pressure_kpa, measurement.radius_mm, measurement.setpoint_kpa) == (8.5, 8.2, 8.0)
    assert measurement.state is State.HOLDING
    assert measurement.status == {Status.HOLDING, Status.IN_CONTACT}
    assert receiver.wait_for_identity(0.0) == 7


def test_the_counter_wraps_and_counts_lost_frames(receiver):
    before = receiver.measurement().sample_counter
    receiver.receive(force(0))
    receiver.receive(force(3))
    assert receiver.measurement().sample_counter == before + 4


def test_a_repeated_frame_is_no_new_sample_and_becomes_stale(receiver):
    slot = LatestSample()
    receiver.add(slot)
    time.sleep(0.22)
    receiver.receive(force(255))
    assert slot.wait_for_new(receiver.measurement().sample_counter, 0.0, 0.1) is None
    assert not receiver.measurement().valid
    assert Status.STALE in receiver.measurement().status


@pytest.mark.parametrize(
    "invalid",
    [
        {"force_n": math.nan},
        {"status": frozenset({"holding"})},
        {"status": frozenset({"force_valid", "stale_or_lost"})},
    ],
    ids=["not_available", "bit_not_set", "stale"],
)
def test_every_invalid_force_frame_gives_no_force(receiver, invalid):
    receiver.receive(force(0, **invalid))
    assert not receiver.measurement().valid


def test_after_a_trip_the_last_force_is_not_valid(receiver):
    receiver.receive(frame(STATUS_FRAME, state="tripped"))
    assert not receiver.measurement().valid
    assert receiver.measurement().state is State.TRIPPED


def test_frames_of_other_nodes_and_malformed_frames_are_ignored(receiver):
    before = receiver.measurement().sample_counter
    receiver.receive(CanFrame(FORCE.base_id + 6, force(0).data))
    receiver.receive(CanFrame(FORCE.base_id + 5, force(0).data[:7]))
    assert receiver.measurement().sample_counter == before


def test_the_first_fault_is_kept_until_the_faults_are_cleared(receiver):
    for code, count in ((0xFF05, 1), (0xFF20, 2)):
        receiver.receive(frame(EMERGENCY, error_code=code, error_register=0x81, active_fault_count=count))
    assert receiver.first_out_fault == 5
    receiver.receive(frame(EMERGENCY, error_code=0, error_register=0, active_fault_count=0))
    assert receiver.first_out_fault == 0


def test_a_vent_of_another_node_and_a_restart_are_noticed(receiver):
    command = {"setpoint": 0.0, "lease": 0.0, "proof_test": "allowed", "sequence": 1}
    for event in (frame(COMMAND, mode="vent", **command), frame(HEARTBEAT, node_state="boot_up")):
        receiver.expect(1, is_vent=True)
        assert not receiver.vented_by_another_node
        receiver.receive(event)
        assert receiver.vented_by_another_node
        receiver.expect(2, is_vent=False)
        assert receiver.vented_by_another_node
