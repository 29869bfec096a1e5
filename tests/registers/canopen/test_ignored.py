"""Tests of the counter for ignored frames. Only frames with an identifier of this node are counted."""

import pytest

from pneuforce.registers.can.wire import CanFrame, FrameKind
from tests.registers.canopen.cases import OPERATIONAL, PRE, STOPPED
from tests.registers.canopen.fake_master import FakeMaster, parse_frame

IGNORED = [
    (PRE, "000"),
    (PRE, "000 01"),
    (PRE, "000 01 05 00"),
    (PRE, "000 03 05"),
    (OPERATIONAL, "080 07 07"),
    (PRE, "080 07 07"),
    (PRE, "605 !"),
    (PRE, "605 40 00 10 00 !"),
    (STOPPED, "605 40 00 10 00"),
    (OPERATIONAL, "185 00"),
    (OPERATIONAL, "585 00"),
    (OPERATIONAL, "705 05"),
]
#: Frames that are handled, rejected Commands, frames to all nodes, and frames to other nodes.
NOT_IGNORED = [
    (PRE, "000 01 06"),
    (PRE, "000 01 00"),
    (PRE, "080"),
    (OPERATIONAL, "080 07"),
    (PRE, "605 40 00 10 00"),
    (PRE, "605 80 00 10 00"),
    (PRE, "205 40 1F 01 01 00 00 00 00"),
    (STOPPED, "205 40 1F 01 01 00 00 00 00"),
    (STOPPED, "205 00 00 00 01 00 00 00 00"),
    (OPERATIONAL, "205 40 1F 01 01 00 00 00 00"),
    (OPERATIONAL, "186 00"),
]


@pytest.mark.parametrize(("state", "step"), IGNORED)
def test_an_ignored_frame_is_counted(state, step):
    master = FakeMaster(state)
    assert master.send(step) == []
    assert master.node.counters.ignored == 1


@pytest.mark.parametrize(("state", "step"), NOT_IGNORED)
def test_a_handled_frame_and_a_frame_for_another_node_are_not_counted(state, step):
    master = FakeMaster(state)
    master.send(step)
    assert master.node.counters.ignored == 0


@pytest.mark.parametrize("can_id", [0x000, 0x080, 0x205, 0x605, 0x705])
@pytest.mark.parametrize("kind", [FrameKind.REMOTE, FrameKind.EXTENDED])
def test_a_remote_or_extended_frame_is_counted_once(can_id, kind):
    master = FakeMaster(OPERATIONAL)
    assert master.node.receive(CanFrame(can_id, b"\x01\x05", kind), 0.0) == []
    assert master.node.counters.ignored == 1


@pytest.mark.parametrize("vent", ["205 00 00 00 01 00 00 00 00", "605 2B 04 22 00 00"])
def test_a_remote_or_extended_frame_is_not_a_vent(vent):
    node, frame = FakeMaster(OPERATIONAL).node, parse_frame(vent)
    assert node.is_vent(frame)
    assert not any(node.is_vent(frame._replace(kind=kind)) for kind in (FrameKind.REMOTE, FrameKind.EXTENDED))
