"""Commands that never reach the source: it hears of them, for whoever keeps a log."""

import pytest

from registers.can.frames import COMMAND, encode
from registers.can.node import CanNode
from registers.can.options import Options
from registers.can.wire import CanFrame, Kind
from tests.registers.can.rig import Rig

HOLD = {"setpoint": 8.0, "mode": "hold", "sequence": 1, "lease": 0.0, "reserved": 0}
GOOD = encode(COMMAND, None, **HOLD)


def heard(*frames):
    rig = Rig()
    node = CanNode(rig, Options())
    for data, kind in frames:
        node.receive(CanFrame(0x205, data, kind), 0.0)
    return rig.turned_away


@pytest.mark.parametrize(
    ("data", "why"),
    [(GOOD[:7], "length"), (b"", "length"), (b"\xff\xff" + GOOD[2:], "span")],
)
def test_a_malformed_command_is_told_with_its_bytes(data, why):
    assert heard((data, Kind.DATA)) == [(data, why)]


def test_a_sequence_with_other_content_is_told():
    other = encode(COMMAND, None, **HOLD | {"setpoint": 9.0})
    assert heard((GOOD, Kind.DATA), (other, Kind.DATA)) == [(other, "sequence")]


def test_a_command_that_was_carried_out_or_repeated_is_not_told():
    assert heard((GOOD, Kind.DATA), (GOOD, Kind.DATA)) == []


def test_frames_that_are_none_of_ours_to_obey_are_not_told():
    assert heard((GOOD, Kind.REMOTE)) == []
