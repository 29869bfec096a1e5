"""A CAN frame as it lies on the wire, and the bits that it takes."""

from __future__ import annotations

from enum import Flag, auto
from typing import NamedTuple

_STUFFABLE_OVERHEAD_BITS = 34  #: start, identifier, control and CRC of a frame with an 11-bit identifier
_FIXED_BITS = 13  #: CRC delimiter, acknowledge, end of frame and the pause before the next


class Kind(Flag):
    """What sets a frame apart from a data frame with an 11-bit identifier."""

    DATA = 0
    EXTENDED = auto()  #: 29-bit identifier
    REMOTE = auto()  #: asks for data, carries none
    ERROR = auto()  #: the controller's own report; no frame of any node


class CanFrame(NamedTuple):
    """One classic CAN frame."""

    id: int
    data: bytes = b""
    kind: Kind = Kind.DATA


def longest_bits(length: int) -> int:
    """Bits that a frame with `length` data bytes takes at worst, stuffed (Davis et al. 2007, eq. 1)."""
    stuffable = _STUFFABLE_OVERHEAD_BITS + 8 * length
    return stuffable + _FIXED_BITS + (stuffable - 1) // 4
