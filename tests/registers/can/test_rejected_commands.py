"""Tests of the log entries about Commands that the node itself rejects."""

import pytest

from pneuforce.registers.can.frames import COMMAND, encode
from pneuforce.registers.can.node import CanNode
from pneuforce.registers.can.options import CanOptions
from pneuforce.registers.can.wire import CanFrame, FrameKind
from tests.registers.can.fake_source import FakeSource

HOLD = {"setpoint": 8.0, "mode": "hold", "sequence": 1, "lease": 0.0, "proof_test": "allowed"}
GOOD = encode(COMMAND, None, **HOLD)


def logged(*frames):
    source = FakeSource()
    node = CanNode(source, CanOptions())
    for data, kind in frames:
        node.receive(CanFrame(0x205, data, kind), 0.0)
    return source.rejected_writes


@pytest.mark.parametrize(
    ("data", "reason"),
    [(GOOD[:7], "invalid_length"), (b"", "invalid_length"), (b"\xff\xff" + GOOD[2:], "out_of_range")],
)
def test_a_malformed_command_is_logged_with_its_bytes(data, reason):
    assert logged((data, FrameKind.DATA)) == [(data, reason)]


def test_a_used_sequence_with_other_content_is_logged():
    other = encode(COMMAND, None, **HOLD | {"setpoint": 9.0})
    assert logged((GOOD, FrameKind.DATA), (other, FrameKind.DATA)) == [(other, "sequence_reused")]


def test_an_accepted_or_repeated_command_is_not_logged():
    assert logged((GOOD, FrameKind.DATA), (GOOD, FrameKind.DATA)) == []


def test_a_remote_frame_is_not_logged():
    assert logged((GOOD, FrameKind.REMOTE)) == []
