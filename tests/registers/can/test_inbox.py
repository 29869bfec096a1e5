"""A flood before the node: it is cut, but no vent is."""

import pytest

from registers.can.command import vents
from registers.can.frames import COMMAND, encode
from registers.can.inbox import MOST_FRAMES, Inbox
from registers.can.wire import CanFrame

HOLD = {"setpoint": 8.0, "mode": "hold", "sequence": 1, "lease": 0.0, "reserved": 0}


def command(**changes):
    return CanFrame(0x205, encode(COMMAND, None, **(HOLD | changes)))


def filled(*frames):
    """What is taken out of an inbox into which these were put, and how many it dropped."""
    inbox = Inbox(lambda frame: vents(frame.data))
    taken = [frame for frame in frames if inbox.put(frame)]
    return [inbox.take() for _ in taken], inbox.dropped


def test_frames_come_out_as_they_went_in():
    frames = [command(sequence=number) for number in range(MOST_FRAMES)]
    assert filled(*frames) == (frames, 0)


def test_a_flood_is_cut_and_counted():
    frames = [command(sequence=number) for number in range(MOST_FRAMES + 5)]
    assert filled(*frames) == (frames[:MOST_FRAMES], 5)


def test_a_vent_gets_in_however_many_wait():
    frames = [command(sequence=number) for number in range(MOST_FRAMES + 5)]
    taken, dropped = filled(*frames, command(mode="vent"), *frames)
    assert (len(taken), dropped) == (MOST_FRAMES, 6 + len(frames))
    assert taken[-1] == command(mode="vent")
    assert taken[:-1] == frames[: MOST_FRAMES - 1]


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
def test_a_vent_is_told_by_its_mode_alone_in_a_frame_of_full_length(data, expected):
    assert vents(data) is expected
