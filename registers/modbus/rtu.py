"""Modbus RTU framing without I/O: received bytes and their arrival times → complete frames.

Section numbers are those of "Modbus over Serial Line, Specification and Implementation Guide", V1.02.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

MIN_FRAME_BYTES, MAX_FRAME_BYTES = 4, 256
_CHARACTER_BITS = 11  #: start bit, 8 data bits, parity or second stop bit, stop bit (2.5.1)
_MAX_SCALED_BAUD, _FIXED_SILENCE_S = 19200, 0.00175  #: above this baud rate the silence is fixed (2.5.1.1)
_BUFFER_CHARACTERS = 16  #: size of a UART's receive buffer
_ADAPTER_S = 0.05  #: delay by a USB adapter (16 ms) and by a late timer of this process
_MAX_BUFFERED_BYTES, _MAX_STARTS = 4 * MAX_FRAME_BYTES, 32


@dataclass(frozen=True, slots=True)
class RtuTiming:
    """Times that follow from a baud rate."""

    baud: int

    @property
    def character_s(self) -> float:
        """Return the time of one character [s]."""
        return _CHARACTER_BITS / self.baud

    @property
    def silence_s(self) -> float:
        """Return the silence that ends a frame, t3.5 [s]."""
        return 3.5 * self.character_s if self.baud <= _MAX_SCALED_BAUD else _FIXED_SILENCE_S

    @property
    def max_pause_s(self) -> float:
        """Return the longest pause within a frame that a UART or an adapter can cause [s]."""
        return self.silence_s + _BUFFER_CHARACTERS * self.character_s + _ADAPTER_S


def crc(data: bytes) -> int:
    """Return the CRC-16 of the serial line (6.2.2). The low byte is sent first.

    The CRC over a complete frame, including its own CRC, is 0.
    """
    state = 0xFFFF
    for byte in data:
        state = state >> 8 ^ _TABLE[(state ^ byte) & 0xFF]
    return state


def encode_frame(unit: int, pdu: bytes) -> bytes:
    """Return the frame that carries `pdu`."""
    body = bytes((unit,)) + pdu
    return body + crc(body).to_bytes(2, "little")


class RtuDecoder:
    """Decoder for the bytes of a serial line. The decoder finds frames by silence and CRC only.

    The length of a frame cannot be read from its function code, because other units may use unknown
    functions. A frame may start only after a silence. At the next silence, the bytes since that start must be
    complete frames up to the last byte: one frame, or several frames if this process was too late to
    detect the silence between them. Otherwise, the decoder tries the next start, so that garbage before a
    frame does not destroy the frame.
    The bytes are kept for `max_pause_s`, because an adapter may have caused the silence. Frames at other
    positions are ignored: the data of another unit may contain bytes that look like a frame for this unit.
    """

    def __init__(self, timing: RtuTiming) -> None:
        self.lost_bytes = 0  #: bytes that belong to no complete frame
        self._timing = timing
        self._data = bytearray()
        self._starts: list[int] = []
        self._after_silence = True
        self._last_received_s = -math.inf

    def feed(self, data: bytes, now_s: float) -> None:
        """Add received bytes."""
        pause_s = now_s - self._last_received_s
        if pause_s >= self._timing.max_pause_s:
            self._drop(len(self._data))
        if self._after_silence or pause_s >= self._timing.silence_s:
            self._add_start()
        self._data += data
        if len(self._data) > _MAX_BUFFERED_BYTES:
            self._drop(len(self._data))
        self._after_silence, self._last_received_s = False, now_s

    def frames(self) -> list[bytes]:
        """Return the frames before the silence that has just passed; [] if they are not complete.

        Call this method after a silence of `silence_s`.
        """
        self._after_silence = True
        for start in self._starts:
            found = _split_frames(bytes(self._data[start:]))
            if found:
                self.lost_bytes += start
                self._data.clear()
                self._starts.clear()
                return found
        return []

    def reset(self) -> None:
        """Drop incomplete frames. The next byte may start a frame."""
        self._drop(len(self._data))
        self._after_silence = True

    def _add_start(self) -> None:
        self._starts.append(len(self._data))
        if len(self._starts) > _MAX_STARTS:
            self._drop(self._starts[1])

    def _drop(self, count: int) -> None:
        self.lost_bytes += count
        del self._data[:count]
        self._starts = [start - count for start in self._starts if start >= count]


def _split_frames(data: bytes) -> list[bytes]:
    """Return `data` split into adjacent frames, as few as possible; [] if the split is impossible."""
    start_of = {0: 0}  # end of a frame → its start
    for at in range(len(data)):
        if at in start_of:
            for end in _possible_ends(data, at):
                start_of.setdefault(end, at)
    found: list[bytes] = []
    end = len(data)
    while end and end in start_of:
        found.insert(0, data[start_of[end] : end])
        end = start_of[end]
    return found


def _possible_ends(data: bytes, start: int) -> list[int]:
    """Return the positions at which a frame that starts at `start` can end.

    Several positions are possible, because the CRC of a frame stays valid if zeros follow.
    """
    longest = data[start : start + MAX_FRAME_BYTES]
    # Function 0 does not exist. Without this check, 1000 zeros take 8 ms; with it, 0.1 ms.
    if len(longest) < MIN_FRAME_BYTES or not longest[1]:
        return []
    ends, state = [], 0xFFFF
    for count, byte in enumerate(longest, 1):
        state = state >> 8 ^ _TABLE[(state ^ byte) & 0xFF]
        if not state and count >= MIN_FRAME_BYTES:
            ends.append(start + count)
    return ends


def _crc_table() -> list[int]:
    """Return the CRC of each byte value: polynomial 8005h, bits reversed."""
    table = list(range(256))
    for _ in range(8):
        table = [state >> 1 ^ (0xA001 if state & 1 else 0) for state in table]
    return table


_TABLE = _crc_table()
