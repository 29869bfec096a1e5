"""Modbus TCP framing (MBAP header) without I/O: bytes in, requests out."""

from __future__ import annotations

import struct
from typing import NamedTuple

_HEADER = struct.Struct(">HHHB")  # transaction, protocol, length of the following bytes, unit
_LENGTH_END = 6
_MIN_LENGTH, _MAX_LENGTH = 2, 254


class MbapRequest(NamedTuple):
    """One request with its transaction and unit identifiers."""

    transaction: int
    unit: int
    pdu: bytes


def encode_frame(transaction: int, unit: int, pdu: bytes) -> bytes:
    """Return the frame that carries `pdu`."""
    return _HEADER.pack(transaction, 0, len(pdu) + 1, unit) + pdu


class MbapDecoder:
    """Decoder for the byte stream of one connection, however the stream is split into pieces.

    After an invalid header the start of the next frame is unknown. `error` then describes the header, no
    further requests are returned, and the connection must be closed.
    """

    def __init__(self) -> None:
        self.error = ""
        self._rest = b""

    @property
    def is_incomplete(self) -> bool:
        """Return True if a frame has started and not ended."""
        return bool(self._rest)

    def feed(self, data: bytes) -> list[MbapRequest]:
        """Return the requests that `data` completes, in order."""
        data = self._rest + data
        start, requests = 0, []
        while not self.error and len(data) - start >= 4:
            end = self._frame_end(data, start)
            if end is None or end > len(data):
                break
            transaction, _, _, unit = _HEADER.unpack_from(data, start)
            requests.append(MbapRequest(transaction, unit, data[start + _HEADER.size : end]))
            start = end
        self._rest = b"" if self.error else data[start:]
        return requests

    def _frame_end(self, data: bytes, start: int) -> int | None:
        """Return the end of the frame at `start`; None if its header is incomplete or invalid."""
        protocol = data[start + 2] << 8 | data[start + 3]
        if protocol:
            self.error = f"protocol identifier {protocol:04X}h"
            return None
        if len(data) - start < _LENGTH_END:
            return None
        length = data[start + 4] << 8 | data[start + 5]
        if not _MIN_LENGTH <= length <= _MAX_LENGTH:
            self.error = f"length {length}"
            return None
        return start + _LENGTH_END + length
