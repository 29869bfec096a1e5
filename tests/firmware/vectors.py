"""Streams to the board and the frames in them, as data: `python -m tests.firmware.vectors` writes them."""

import json
from pathlib import Path

from instrument.rig.frames import Command, Hello, Identify, Mode, Vent, encode

VECTORS = Path(__file__).with_name("vectors.json")
HOLD = encode(Command(Mode.HOLD, 2, 8000, -250, 18_000, 2_000, 3), 0x1234)
VENT = encode(Vent(), 0xFFFF)
GREETING = encode(Identify(), 1)


def flipped(frame, position, mask=1):
    return frame[:position] + bytes([frame[position] ^ mask]) + frame[position + 1 :]


#: What happens, the stream, and the frames that a board hears in it.
CASES = (
    ("a command", HOLD, [HOLD]),
    ("a vent", VENT, [VENT]),
    ("a greeting", GREETING, [GREETING]),
    ("a greeting of another version is heard", encode(Identify(), 2, 9), [encode(Identify(), 2, 9)]),
    ("a command of another version is not", encode(Command(), 2, 9), []),
    ("the board is deaf to boards", encode(Hello(2, 256, 1, 1, 250, 2000), 1), []),
    ("three frames without a gap", VENT + HOLD + GREETING, [VENT, HOLD, GREETING]),
    ("noise before, between and after", b"\x00\xa5" + VENT + b"\xa5\x5a\xa5" + HOLD + b"\xa5", [VENT, HOLD]),
    ("a frame cut short, and a whole one", HOLD[:17] + VENT, [VENT]),
    ("a start inside a start", b"\xa5\xa5\x5a" + VENT[2:] + VENT, [VENT, VENT]),
    ("a frame within a refused one", b"\xa5\x5a\xaa\x01" + VENT, [VENT]),
    ("a byte lost", HOLD[:9] + HOLD[10:] + VENT, [VENT]),
    ("a byte doubled", HOLD[:9] + HOLD[8:] + VENT, [VENT]),
    ("a wrong kind", flipped(VENT, 2, 0x55) + HOLD, [HOLD]),
    ("a wrong CRC", flipped(HOLD, 23) + VENT, [VENT]),
    ("a flipped bit of the setpoint", flipped(HOLD, 8, 0x40) + VENT, [VENT]),
    ("nothing but starts", b"\xa5\x5a" * 60, []),
    ("nothing", b"", []),
)


def render():
    """The vectors as JSON, bytes in hexadecimal."""
    rows = [
        {"name": name, "stream": stream.hex(), "frames": [frame.hex() for frame in frames]}
        for name, stream, frames in CASES
    ]
    return json.dumps(rows, indent=1) + "\n"


if __name__ == "__main__":
    VECTORS.write_text(render(), encoding="utf-8")
