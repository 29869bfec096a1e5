"""Tests of emergency messages: number, time, and contents. A message contains the values at its error."""

import struct

import pytest

from pneuforce.registers.can.frames import EMERGENCY, decode
from tests.registers.can.fake_source import FakeSource
from tests.registers.canopen.cases import OPERATIONAL, PRE, STOPPED
from tests.registers.canopen.fake_master import FakeMaster

MONITOR_MASTER = "605 23 16 10 01 F4 01 7F 00"  # heartbeat deadline of node 127: 500 ms


def emergencies(frames):
    """Return error code, error register and number of active faults of each emergency message."""
    return [struct.unpack_from("<HBB", frame.data) for frame in frames if frame.id == 0x085]


def set_faults(master, *codes):
    master.source.set(faults=codes, active_fault_count=len(codes))


@pytest.mark.parametrize("state", [PRE, OPERATIONAL])
def test_a_fault_is_sent_with_its_first_sample(state):
    master = FakeMaster(state)
    set_faults(master, 4)
    assert emergencies(master.node.on_sample(0.001)) == [(0xFF04, 0x81, 1)]


def test_faults_that_come_and_go_while_stopped_are_sent_with_their_own_values():
    master = FakeMaster(STOPPED)
    for codes in ((4,), (4, 13), ()):
        set_faults(master, *codes)
        assert emergencies(master.node.on_sample(0.001)) == []
    master.send("000 80 05")
    assert emergencies(master.node.tick(0.01)) == [(0xFF04, 0x81, 1), (0xFF0D, 0x81, 2), (0x0000, 0, 0)]


def test_of_more_than_32_pending_emergencies_the_newest_are_sent():
    master = FakeMaster(STOPPED)
    for code in range(1, 41):
        set_faults(master, *range(1, code + 1))
        master.node.on_sample(0.001)
    master.send("000 80 05")
    codes = [code for code, _, _ in emergencies(master.node.tick(0.01))]
    assert codes == [0xFF00 + code for code in range(9, 41)]


class TrippingSource(FakeSource):
    """Source that trips when the CANopen master is lost, as an instrument does."""

    def master_lost(self, now_s):
        self.set(status=frozenset({"vented"}), faults=(41,), active_fault_count=1)


def test_the_emergency_about_a_lost_master_contains_the_trip_that_it_causes():
    master = FakeMaster(source=TrippingSource())
    for step in (MONITOR_MASTER, "77F 05"):
        master.send(step)
    frames = [frame for _, frame in master.wait(0.6) if frame.id == 0x085]
    assert emergencies(frames) == [(0x8130, 0x91, 1), (0xFF29, 0x91, 1)]
    assert {decode(EMERGENCY, frame.data)["status"] for frame in frames} == {frozenset({"vented"})}


def test_the_error_register_contains_a_fault_and_a_lost_master_together():
    master = FakeMaster()
    for step in (MONITOR_MASTER, "77F 05", "faults 3"):
        master.send(step)
    assert emergencies(f for _, f in master.wait(0.6)) == [(0xFF03, 0x81, 1), (0x8130, 0x91, 1)]
    assert master.send("605 40 01 10 00")[0].data[4] == 0x91
    master.send("77F 05")
    assert emergencies(f for _, f in master.wait(0.1)) == [(0x0000, 0x81, 1)]


def test_a_command_that_is_too_long_is_not_carried_out():
    """Classic CAN has no frames of 9 bytes, but the node does not rely on its interface."""
    master = FakeMaster(OPERATIONAL)
    assert emergencies(master.send("205 40 1F 01 01 00 00 00 00 00")) == [(0x8220, 0x11, 0)]
    assert master.source.written == []
