"""Tests of the receive queue. A full queue drops commands, but never a vent."""

import pytest

from pneuforce.registers.can.command import is_vent_command
from pneuforce.registers.can.frames import COMMAND, encode
from pneuforce.registers.can.receive_queue import MAX_FRAMES, ReceiveQueue
from pneuforce.registers.can.wire import CanFrame

HOLD = {"setpoint": 8.0, "mode": "hold", "sequence": 1, "lease": 0.0, "proof_test": "allowed"}


def command(**changes):
    return CanFrame(0x205, encode(COMMAND, None, **(HOLD | changes)))


def put_and_get(*frames):
    """Put frames into a queue. Return the frames read from the queue, and the number of dropped frames."""
    queue = ReceiveQueue(lambda frame: is_vent_command(frame.data))
    taken = [frame for frame in frames if queue.put(frame)]
    return [queue.get() for _ in taken], queue.dropped


def test_frames_come_out_in_the_same_order():
    frames = [command(sequence=number) for number in range(MAX_FRAMES)]
    assert put_and_get(*frames) == (frames, 0)


def test_frames_over_the_limit_are_dropped_and_counted():
    frames = [command(sequence=number) for number in range(MAX_FRAMES + 5)]
    assert put_and_get(*frames) == (frames[:MAX_FRAMES], 5)


def test_a_vent_enters_a_full_queue():
    frames = [command(sequence=number) for number in range(MAX_FRAMES + 5)]
    taken, dropped = put_and_get(*frames, command(mode="vent"), *frames)
    assert (len(taken), dropped) == (MAX_FRAMES, 6 + len(frames))
    assert taken[-1] == command(mode="vent")
    assert taken[:-1] == frames[: MAX_FRAMES - 1]


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (command(mode="vent").data, True),
        (b"\xff\xff\x00" + 5 * b"\xff", True),
        (command().data, False),
        (command(mode="clear_faults").data, False),
        (command(mode="vent").data[:7], False),
        (b"", False),
    ],
)
def test_a_vent_is_recognized_by_its_mode_in_a_frame_of_full_length(data, expected):
    assert is_vent_command(data) is expected
