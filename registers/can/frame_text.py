"""CAN frames as text, in the notation of cansend and candump: `205#0000000100000000`."""

from __future__ import annotations

import re

from pneuforce.registers.can.wire import CanFrame, FrameKind

#: Identifier with 3 or 8 hexadecimal digits, "#", and bytes, optionally divided by dots (can-utils).
_FRAME = re.compile(r"(?P<id>[0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})#(?P<data>(?:[0-9A-Fa-f]{2}\.?)*)")
_MAX_BYTES = 8
_MAX_IDS = {3: 0x7FF, 8: 0x1FFF_FFFF}  #: highest identifier by its number of digits
_EXAMPLE = "205#0000000100000000"


def parse_frame(text: str) -> CanFrame:
    """Return the frame of an argument of cansend or of a line of `candump -L`.

    A line of candump contains the time and the interface before the frame. Raises ValueError.
    """
    words = text.split()
    match = _FRAME.fullmatch(words[-1]) if words else None
    if match is None:
        raise _invalid(text, f"write identifier#data in hexadecimal digits, for example {_EXAMPLE}")
    identifier, digits = int(match["id"], 16), len(match["id"])
    if identifier > _MAX_IDS[digits]:
        raise _invalid(text, f"an identifier with {digits} digits is at most {_MAX_IDS[digits]:X}")
    data = bytes.fromhex(match["data"].replace(".", ""))
    if len(data) > _MAX_BYTES:
        raise _invalid(text, f"it has {len(data)} bytes, and a frame has at most {_MAX_BYTES} bytes")
    return CanFrame(identifier, data, FrameKind.EXTENDED if digits > 3 else FrameKind.DATA)


def _invalid(text: str, why: str) -> ValueError:
    return ValueError(f"{text.strip()!r} is not a CAN frame: {why}")
