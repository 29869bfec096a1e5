"""Emergencies: which are told, when, and that each tells of the instant it was noted at."""

import struct

import pytest

from registers.can.frames import EMERGENCY, decode
from tests.registers.can.rig import Rig
from tests.registers.canopen.cases import OPERATIONAL, PRE, STOPPED
from tests.registers.canopen.talking import Master

WATCH = "605 23 16 10 01 F4 01 7F 00"  # node 127, 500 ms


def told(frames):
    """Error code, error register and number of active faults of each emergency."""
    return [struct.unpack_from("<HBB", frame.data) for frame in frames if frame.id == 0x085]


def fault(master, *codes):
    master.rig.set(faults=codes, active_faults=len(codes))


@pytest.mark.parametrize("state", [PRE, OPERATIONAL])
def test_a_fault_is_told_at_the_sample_that_shows_it(state):
    master = Master(state)
    fault(master, 4)
    assert told(master.node.on_sample(0.001)) == [(0xFF04, 0x81, 1)]


def test_a_fault_that_came_and_went_while_stopped_is_told_as_it_was():
    master = Master(STOPPED)
    for codes in ((4,), (4, 13), ()):
        fault(master, *codes)
        assert told(master.node.on_sample(0.001)) == []
    master.say("000 80 05")
    assert told(master.node.tick(0.01)) == [(0xFF04, 0x81, 1), (0xFF0D, 0x81, 2), (0x0000, 0, 0)]


def test_of_more_than_32_that_wait_the_newest_are_told():
    master = Master(STOPPED)
    for code in range(1, 41):
        fault(master, *range(1, code + 1))
        master.node.on_sample(0.001)
    master.say("000 80 05")
    codes = [code for code, _, _ in told(master.node.tick(0.01))]
    assert codes == [0xFF00 + code for code in range(9, 41)]


class TrippingRig(Rig):
    """One that trips when its master is lost, as an instrument does."""

    def master_lost(self, now_s):
        self.set(status=frozenset({"vented"}), faults=(41,), active_faults=1)


def test_the_loss_of_the_master_is_told_with_what_the_instrument_made_of_it():
    master = Master(rig=TrippingRig())
    for said in (WATCH, "77F 05"):
        master.say(said)
    frames = [frame for _, frame in master.wait(0.6) if frame.id == 0x085]
    assert told(frames) == [(0x8130, 0x91, 1), (0xFF29, 0x91, 1)]
    assert {decode(EMERGENCY, frame.data)["status"] for frame in frames} == {frozenset({"vented"})}


def test_the_error_register_has_both_a_fault_of_the_rig_and_a_lost_master():
    master = Master()
    for said in (WATCH, "77F 05", "faults 3"):
        master.say(said)
    assert told(f for _, f in master.wait(0.6)) == [(0xFF03, 0x81, 1), (0x8130, 0x91, 1)]
    assert master.say("605 40 01 10 00")[0].data[4] == 0x91
    master.say("77F 05")
    assert told(f for _, f in master.wait(0.1)) == [(0x0000, 0x81, 1)]
