"""Test vectors for decoders: streams to the board and the frames in them.

`python -m tests.firmware.vectors` writes vectors.json.
"""

import json
from pathlib import Path

from pneuforce.protocol.frames import Command, Hello, Identify, Mode, Vent, encode

VECTORS = Path(__file__).with_name("vectors.json")
HOLD = encode(Command(Mode.HOLD, 2, 8000, -250, 18_000, 2_000, 3), 0x1234)
VENT = encode(Vent(), 0xFFFF)
IDENTIFY = encode(Identify(), 1)


def flipped(frame, position, mask=1):
    return frame[:position] + bytes([frame[position] ^ mask]) + frame[position + 1 :]


#: Name of the case, the stream, and the frames that a board decodes from it.
CASES = (
    ("a command", HOLD, [HOLD]),
    ("a vent", VENT, [VENT]),
    ("an identify", IDENTIFY, [IDENTIFY]),
    ("an identify of another version is accepted", encode(Identify(), 2, 9), [encode(Identify(), 2, 9)]),
    ("a command of another version is rejected", encode(Command(), 2, 9), []),
    ("a frame of a board is rejected", encode(Hello(2, 256, 1, 1, 250, 2000), 1), []),
    ("three frames without a gap", VENT + HOLD + IDENTIFY, [VENT, HOLD, IDENTIFY]),
    ("noise before, between and after", b"\x00\xa5" + VENT + b"\xa5\x5a\xa5" + HOLD + b"\xa5", [VENT, HOLD]),
    ("a frame cut short, and a complete frame", HOLD[:17] + VENT, [VENT]),
    ("a start inside a start", b"\xa5\xa5\x5a" + VENT[2:] + VENT, [VENT, VENT]),
    ("a frame within a rejected frame", b"\xa5\x5a\xaa\x01" + VENT, [VENT]),
    ("a lost byte", HOLD[:9] + HOLD[10:] + VENT, [VENT]),
    ("a doubled byte", HOLD[:9] + HOLD[8:] + VENT, [VENT]),
    ("a wrong kind", flipped(VENT, 2, 0x55) + HOLD, [HOLD]),
    ("a wrong CRC", flipped(HOLD, 23) + VENT, [VENT]),
    ("a flipped bit of the setpoint", flipped(HOLD, 8, 0x40) + VENT, [VENT]),
    ("starts only", b"\xa5\x5a" * 60, []),
    ("an empty stream", b"", []),
)


def render():
    """Return the vectors as JSON, with bytes in hexadecimal."""
    rows = [
        {"name": name, "stream": stream.hex(), "frames": [frame.hex() for frame in frames]}
        for name, stream, frames in CASES
    ]
    return json.dumps(rows, indent=1) + "\n"


if __name__ == "__main__":
    VECTORS.write_text(render(), encoding="utf-8")
