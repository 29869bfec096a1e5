"""The SDO server without I/O (CiA 301, 7.2.4.3): requests in, answers out; one transfer at a time."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

from registers.canopen.abort import Abort, Why
from registers.canopen.dictionary import entry_at
from registers.canopen.entry import Entry

TIMEOUT_S = 2.0  #: between two segments of a transfer
_LENGTH = 8
_SEGMENT = 7
_DOWNLOAD = 1
_EXPEDITED, _SIZED = 2, 1  #: bits of a request to download
_NOWHERE = b"\x00\x00\x00"


class Values(Protocol):
    """What stands behind the entries."""

    def read(self, entry: Entry, now_s: float) -> bytes:
        """Its value. Raises Abort."""
        ...

    def check(self, entry: Entry, now_s: float) -> None:
        """See that it may be written at all. Raises Abort."""
        ...

    def write(self, entry: Entry, raw: bytes, now_s: float) -> None:
        """Write it whole. Raises Abort."""
        ...

    def vents(self, entry: Entry, raw: bytes) -> bool:
        """Whether writing this asks for a vent and nothing else. Raises Abort: it cannot be written."""
        ...


@dataclass(slots=True)
class _Transfer:
    """A segmented transfer under way: data still to be sent, or collected so far."""

    entry: Entry
    place: bytes
    upload: bool
    data: bytes
    until_s: float
    toggle: int = 0


class SdoServer:
    """Answers one client's requests. What goes wrong ends the transfer, and nothing was written."""

    def __init__(self, values: Values) -> None:
        self._values = values
        self._transfer: _Transfer | None = None
        self._services: Mapping[int, Callable[[bytes, float], bytes]] = {
            0: self._download_segment,
            _DOWNLOAD: self._download,
            2: self._upload,
            3: self._upload_segment,
        }

    def take(self, request: bytes, now_s: float) -> bytes | None:
        """The answer to one request, empty to the client's own abort; None for what is no request."""
        if len(request) != _LENGTH:
            return None
        specifier = request[0] >> 5
        if specifier == 4:
            self._transfer = None
            return b""
        in_transfer = specifier in (0, 3)
        place = request[1:4] if not in_transfer else self._transfer.place if self._transfer else _NOWHERE
        try:
            if specifier not in self._services:
                raise Abort(Why.COMMAND)
            return self._services[specifier](request, now_s)
        except Abort as abort:
            return self._aborted(place, abort.why)

    def vents(self, request: bytes) -> bool:
        """Whether a request asks for a vent, in one frame."""
        if len(request) != _LENGTH or request[0] >> 5 != _DOWNLOAD or not request[0] & _EXPEDITED:
            return False
        try:
            entry = _entry_of(request)
            return self._values.vents(entry, _value_in(request, entry))
        except Abort:
            return False

    def tick(self, now_s: float) -> bytes | None:
        """The abort of a transfer that its client has given up."""
        if self._transfer is None or now_s <= self._transfer.until_s:
            return None
        return self._aborted(self._transfer.place, Why.TIMEOUT)

    def _aborted(self, place: bytes, why: Why) -> bytes:
        self._transfer = None
        return b"\x80" + place + struct.pack("<I", why.code)

    def _upload(self, request: bytes, now_s: float) -> bytes:
        self._transfer = None
        place, entry = request[1:4], _entry_of(request)
        data = self._values.read(entry, now_s)
        if 0 < len(data) <= 4:
            return bytes((0x43 | 4 - len(data) << 2,)) + place + data.ljust(4, b"\0")
        self._transfer = _Transfer(entry, place, True, data, now_s + TIMEOUT_S)
        return b"\x41" + place + struct.pack("<I", len(data))

    def _upload_segment(self, request: bytes, now_s: float) -> bytes:
        transfer = self._next(request, now_s, upload=True)
        segment, transfer.data = transfer.data[:_SEGMENT], transfer.data[_SEGMENT:]
        last = not transfer.data
        if last:
            self._transfer = None
        head = request[0] & 0x10 | _SEGMENT - len(segment) << 1 | last
        return bytes((head,)) + segment.ljust(_SEGMENT, b"\0")

    def _download(self, request: bytes, now_s: float) -> bytes:
        self._transfer = None
        place, entry, sized = request[1:4], _entry_of(request), request[0] & _SIZED
        self._values.check(entry, now_s)
        if request[0] & _EXPEDITED:
            self._values.write(entry, _value_in(request, entry), now_s)
        else:
            size = int.from_bytes(request[4:], "little") if sized else entry.type.size
            if size != entry.type.size:
                raise Abort(Why.TOO_LONG if size > entry.type.size else Why.TOO_SHORT)
            self._transfer = _Transfer(entry, place, False, b"", now_s + TIMEOUT_S)
        return b"\x60" + place + bytes(4)

    def _download_segment(self, request: bytes, now_s: float) -> bytes:
        transfer = self._next(request, now_s, upload=False)
        transfer.data += request[1 : 1 + _SEGMENT - (request[0] >> 1 & 7)]
        if len(transfer.data) > transfer.entry.type.size:
            raise Abort(Why.TOO_LONG)
        if request[0] & 1:
            self._transfer = None
            self._values.write(transfer.entry, transfer.data, now_s)
        return bytes((0x20 | request[0] & 0x10,)) + bytes(_SEGMENT)

    def _next(self, request: bytes, now_s: float, *, upload: bool) -> _Transfer:
        """The transfer that a segment belongs to. Raises Abort: none, or a segment out of turn."""
        transfer = self._transfer
        if transfer is None or transfer.upload != upload:
            raise Abort(Why.COMMAND)
        if request[0] >> 4 & 1 != transfer.toggle:
            raise Abort(Why.TOGGLE)
        transfer.toggle ^= 1
        transfer.until_s = now_s + TIMEOUT_S
        return transfer


def _value_in(request: bytes, entry: Entry) -> bytes:
    length = 4 - (request[0] >> 2 & 3) if request[0] & _SIZED else entry.type.size
    return request[4 : 4 + length]


def _entry_of(request: bytes) -> Entry:
    index, sub = struct.unpack_from("<HB", request, 1)
    return entry_at(index, sub)
