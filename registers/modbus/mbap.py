"""Modbus TCP framing without I/O: bytes in, requests out."""

from __future__ import annotations

import struct
from typing import NamedTuple

_HEADER = struct.Struct(">HHHB")  # transaction, protocol, length of what follows, unit
_TO_LENGTH = 6
_SHORTEST, _LONGEST = 2, 254


class Request(NamedTuple):
    """One request, as a frame carried it."""

    transaction: int
    unit: int
    pdu: bytes


def frame(transaction: int, unit: int, pdu: bytes) -> bytes:
    """The bytes that carry `pdu`."""
    return _HEADER.pack(transaction, 0, len(pdu) + 1, unit) + pdu


class Decoder:
    """Bytes of one connection become requests, however they are split or joined.

    There is no way to find the next frame behind a broken header: `broken` then says what was wrong, no
    further request comes, and the connection is to be closed.
    """

    def __init__(self) -> None:
        self.broken = ""
        self._rest = b""

    @property
    def unfinished(self) -> bool:
        """Whether a frame has begun and not ended."""
        return bool(self._rest)

    def feed(self, data: bytes) -> list[Request]:
        """Requests completed by `data`, in order."""
        data = self._rest + data
        at, requests = 0, []
        while not self.broken and len(data) - at >= 4:
            end = self._end(data, at)
            if end is None or end > len(data):
                break
            transaction, _, _, unit = _HEADER.unpack_from(data, at)
            requests.append(Request(transaction, unit, data[at + _HEADER.size : end]))
            at = end
        self._rest = b"" if self.broken else data[at:]
        return requests

    def _end(self, data: bytes, at: int) -> int | None:
        """Where the frame that begins at `at` ends; None where its header is incomplete or broken."""
        protocol = data[at + 2] << 8 | data[at + 3]
        if protocol:
            self.broken = f"protocol identifier {protocol:04X}h"
            return None
        if len(data) - at < _TO_LENGTH:
            return None
        length = data[at + 4] << 8 | data[at + 5]
        if not _SHORTEST <= length <= _LONGEST:
            self.broken = f"length {length}"
            return None
        return at + _TO_LENGTH + length
