"""CAN frame as sent on the bus, and its length in bits."""

from __future__ import annotations

from enum import Flag, auto
from typing import NamedTuple

_STUFFABLE_OVERHEAD_BITS = 34  #: start, identifier, control and CRC of a frame with an 11-bit identifier
_FIXED_BITS = 13  #: bits without stuffing: CRC delimiter, acknowledge, end of frame, and intermission


class FrameKind(Flag):
    """Flags of a frame. A frame without flags is a data frame with an 11-bit identifier."""

    DATA = 0
    EXTENDED = auto()  #: 29-bit identifier
    REMOTE = auto()  #: remote frame: requests data, has no data
    ERROR = auto()  #: error report of the local controller, not a frame from a node


class CanFrame(NamedTuple):
    """One classic CAN frame."""

    id: int
    data: bytes = b""
    kind: FrameKind = FrameKind.DATA


def worst_case_bits(length: int) -> int:
    """Return the length [bits] of a frame with `length` data bytes and the largest number of stuff bits.

    The equation is eq. 1 of Davis et al. 2007.
    """
    stuffable = _STUFFABLE_OVERHEAD_BITS + 8 * length
    return stuffable + _FIXED_BITS + (stuffable - 1) // 4
