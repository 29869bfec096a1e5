"""Modbus RTU framing without I/O: bytes and their times in, whole frames out.

Sections named are those of "Modbus over Serial Line, Specification and Implementation Guide", V1.02.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

SHORTEST, LONGEST = 4, 256
_CHARACTER_BITS = 11  #: start, 8 data, parity or a second stop, stop (2.5.1)
_FAST_BAUD, _FAST_SILENCE_S = 19200, 0.00175  #: above it the silence is fixed (2.5.1.1)
_BUFFER_CHARACTERS = 16  #: of a UART
_ADAPTER_S = 0.05  #: a USB adapter's timer is 16 ms, ours may be late
_MOST_BYTES, _MOST_STARTS = 4 * LONGEST, 32


@dataclass(frozen=True, slots=True)
class Timing:
    """What a baud rate means in time."""

    baud: int

    @property
    def character_s(self) -> float:
        """One character [s]."""
        return _CHARACTER_BITS / self.baud

    @property
    def silence_s(self) -> float:
        """The silence that ends a frame, t3.5 [s]."""
        return 3.5 * self.character_s if self.baud <= _FAST_BAUD else _FAST_SILENCE_S

    @property
    def patience_s(self) -> float:
        """How long a frame may pause because a UART or an adapter keeps its bytes back [s]."""
        return self.silence_s + _BUFFER_CHARACTERS * self.character_s + _ADAPTER_S


def crc(data: bytes) -> int:
    """CRC-16 of the serial line (6.2.2): low byte sent first; 0 over a frame that is whole."""
    state = 0xFFFF
    for byte in data:
        state = state >> 8 ^ _TABLE[(state ^ byte) & 0xFF]
    return state


def frame(unit: int, pdu: bytes) -> bytes:
    """The bytes that carry `pdu`."""
    body = bytes((unit,)) + pdu
    return body + crc(body).to_bytes(2, "little")


class Decoder:
    """Bytes of a line become frames, by silence and CRC alone: other units may speak functions unknown here.

    Only behind a silence may a frame start. At the next one, what came since must be whole frames to the last
    byte: one, or several that a late scheduler has joined. Where it is not, the next start is tried, so that
    garbage costs nothing behind it; and the bytes are kept for `patience_s`, for the silence may be an
    adapter's. No frame is looked for anywhere else: another unit's data may contain one that looks like ours.
    """

    def __init__(self, timing: Timing) -> None:
        self.lost_bytes = 0  #: that were in no whole frame
        self._timing = timing
        self._data = bytearray()
        self._starts: list[int] = []
        self._silent = True
        self._heard_s = -math.inf

    def feed(self, data: bytes, now_s: float) -> None:
        """Take in what has just come."""
        pause_s = now_s - self._heard_s
        if pause_s >= self._timing.patience_s:
            self._lose(len(self._data))
        if self._silent or pause_s >= self._timing.silence_s:
            self._start()
        self._data += data
        if len(self._data) > _MOST_BYTES:
            self._lose(len(self._data))
        self._silent, self._heard_s = False, now_s

    def frames(self) -> list[bytes]:
        """What came before a silence of `silence_s`, which has passed; [] where it is not whole frames."""
        self._silent = True
        for start in self._starts:
            found = _split(bytes(self._data[start:]))
            if found:
                self.lost_bytes += start
                self._data.clear()
                self._starts.clear()
                return found
        return []

    def forget(self) -> None:
        """Lose what was not finished, as behind a long silence."""
        self._lose(len(self._data))
        self._silent = True

    def _start(self) -> None:
        self._starts.append(len(self._data))
        if len(self._starts) > _MOST_STARTS:
            self._lose(self._starts[1])

    def _lose(self, count: int) -> None:
        self.lost_bytes += count
        del self._data[:count]
        self._starts = [start - count for start in self._starts if start >= count]


def _split(data: bytes) -> list[bytes]:
    """`data` as whole frames, as few as can be found, each from the end of one before; [] where it is not."""
    begun = {0: 0}  # end of a frame → its beginning
    for at in range(len(data)):
        if at in begun:
            for end in _ends(data, at):
                begun.setdefault(end, at)
    found: list[bytes] = []
    end = len(data)
    while end and end in begun:
        found.insert(0, data[begun[end] : end])
        end = begun[end]
    return found


def _ends(data: bytes, at: int) -> list[int]:
    """Where a frame that begins at `at` may end: zeros behind one leave its CRC good."""
    longest = data[at : at + LONGEST]
    if len(longest) < SHORTEST or not longest[1]:  # no function 0: 1000 zeros cost 0.1 ms, not 8
        return []
    ends, state = [], 0xFFFF
    for count, byte in enumerate(longest, 1):
        state = state >> 8 ^ _TABLE[(state ^ byte) & 0xFF]
        if not state and count >= SHORTEST:
            ends.append(at + count)
    return ends


def _table() -> list[int]:
    """CRC of each byte value: polynomial 8005h, bits reversed."""
    table = list(range(256))
    for _ in range(8):
        table = [state >> 1 ^ (0xA001 if state & 1 else 0) for state in table]
    return table


_TABLE = _table()
