"""Tests of the log entries about Commands that the node itself rejects."""

import pytest

from pneuforce.registers.can.command import NO_LEASE, OLD_HOLD, OTHER_COMMAND
from pneuforce.registers.can.frames import COMMAND, encode
from pneuforce.registers.can.node import CanNode
from pneuforce.registers.can.options import CanOptions
from pneuforce.registers.can.wire import CanFrame, FrameKind
from tests.registers.can.fake_source import FakeSource

HOLD = {"setpoint": 8.0, "mode": "hold", "sequence": 1, "lease": 0.0, "proof_test": "allowed"}
GOOD = encode(COMMAND, None, **HOLD)


def receive(source, *frames):
    node = CanNode(source, CanOptions())
    for data, kind in frames:
        node.receive(CanFrame(0x205, data, kind), 0.0)
    return source


def logged(*frames):
    return receive(FakeSource(), *frames).rejected_writes


@pytest.mark.parametrize(
    ("data", "reason"),
    [(GOOD[:7], "invalid_length"), (b"", "invalid_length"), (b"\xff\xff" + GOOD[2:], "out_of_range")],
)
def test_a_malformed_command_is_logged_with_its_bytes(data, reason):
    assert logged((data, FrameKind.DATA)) == [(data, reason)]


def test_a_used_sequence_with_other_content_is_logged():
    other = encode(COMMAND, None, **HOLD | {"setpoint": 9.0})
    source = receive(FakeSource(), (GOOD, FrameKind.DATA), (other, FrameKind.DATA))
    assert source.rejected_writes == [(other, "sequence_reused")]
    assert source.rejected_in_words[0][1] == OTHER_COMMAND


@pytest.mark.parametrize("sequence", [1, 2])
def test_a_hold_that_is_older_than_the_last_vent_is_logged_with_this_reason(sequence):
    vent = encode(COMMAND, None, **HOLD | {"mode": "vent", "sequence": sequence})
    source = receive(FakeSource(), *((data, FrameKind.DATA) for data in (GOOD, vent, GOOD)))
    assert source.rejected_writes == [(GOOD, "sequence_reused")]
    assert source.rejected_in_words[0][1] == OLD_HOLD


def test_a_renewal_of_a_lease_that_another_client_has_ended_is_logged():
    leased = encode(COMMAND, None, **HOLD | {"lease": 1.0})
    source = receive(FakeSource(), (leased, FrameKind.DATA), (leased, FrameKind.DATA))
    assert source.rejected_writes == [(leased, "state")]
    assert source.rejected_in_words[0][1] == NO_LEASE


def test_an_accepted_or_repeated_command_is_not_logged():
    assert logged((GOOD, FrameKind.DATA), (GOOD, FrameKind.DATA)) == []


def test_a_remote_frame_is_not_logged():
    assert logged((GOOD, FrameKind.REMOTE)) == []
