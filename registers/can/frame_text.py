"""CAN frames as text, in the notation of cansend and candump: `205#0000000100000000`."""

from __future__ import annotations

import re

from pneuforce.registers.can.wire import CanFrame, FrameKind

#: Identifier with 3 or 8 hexadecimal digits, "#", and up to 8 bytes, optionally divided by dots (can-utils).
_FRAME = re.compile(r"(?P<id>[0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})#(?P<data>(?:[0-9A-Fa-f]{2}\.?){0,8})")
_MAX_EXTENDED_ID = 0x1FFF_FFFF


def parse_frame(text: str) -> CanFrame:
    """Return the frame of an argument of cansend or of a line of `candump -L`.

    A line of candump contains the time and the interface before the frame. Raises ValueError.
    """
    words = text.split()
    match = _FRAME.fullmatch(words[-1]) if words else None
    if match is None or int(match["id"], 16) > _MAX_EXTENDED_ID:
        raise ValueError(
            f"{text.strip()!r} is not a CAN frame: write identifier#data in hexadecimal digits, for example "
            "205#0000000100000000"
        )
    kind = FrameKind.EXTENDED if len(match["id"]) > 3 else FrameKind.DATA
    return CanFrame(int(match["id"], 16), bytes.fromhex(match["data"].replace(".", "")), kind)
