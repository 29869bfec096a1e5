"""Tests of CAN frames as text: arguments of cansend and lines of candump."""

import pytest

from pneuforce.registers.can.frame_text import parse_frame
from pneuforce.registers.can.wire import CanFrame, FrameKind


@pytest.mark.parametrize(
    ("text", "frame"),
    [
        ("205#0000000100000000", CanFrame(0x205, bytes([0, 0, 0, 1, 0, 0, 0, 0]))),
        ("205#00.00.00.01", CanFrame(0x205, bytes([0, 0, 0, 1]))),
        ("080#", CanFrame(0x080)),
        ("(1700000000.000000) can0 185#E803\n", CanFrame(0x185, b"\xe8\x03")),
        ("18DAF110#01", CanFrame(0x18DAF110, b"\x01", FrameKind.EXTENDED)),
    ],
)
def test_a_frame_is_read(text, frame):
    assert parse_frame(text) == frame


@pytest.mark.parametrize(
    "text",
    [
        "",
        "205",
        "205#0",
        "205#GG",
        "#00",
        "5#00",
        "205#R",
        "Loop t=1",
    ],
)
def test_other_text_is_rejected_with_an_example(text):
    with pytest.raises(ValueError, match="for example 205#0000000100000000"):
        parse_frame(text)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("999#00", "3 digits is at most 7FF"),
        ("800#03", "3 digits is at most 7FF"),
        ("FFFFFFFF#00", "8 digits is at most 1FFFFFFF"),
        ("205#000000000000000000", "it has 9 bytes, and a frame has at most 8 bytes"),
    ],
)
def test_a_frame_that_no_bus_can_carry_is_rejected_with_the_limit(text, why):
    with pytest.raises(ValueError, match=why):
        parse_frame(text)
