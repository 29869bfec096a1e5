"""SDO server without I/O (CiA 301, 7.2.4.3): one transfer at a time."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

from pneuforce.registers.canopen.abort import AbortCode, SdoAbort
from pneuforce.registers.canopen.communication import PDO_MAPPINGS
from pneuforce.registers.canopen.entry import EntryAddress, ObjectEntry
from pneuforce.registers.canopen.object_dictionary import entry_at, find_entry
from pneuforce.registers.canopen.parameter_storage import PendingWrite

TIMEOUT_S = 2.0  #: longest time between two segments of a transfer
_REQUEST_BYTES = 8
_SEGMENT_BYTES = 7
_DOWNLOAD = 1  #: command specifier of "initiate download"
_EXPEDITED, _SIZE_INDICATED = 2, 1  #: bits of "initiate download"
_NO_MULTIPLEXER = b"\x00\x00\x00"  #: index and sub-index in an abort message that refers to no transfer


class EntryStore(Protocol):
    """Access to the values of the entries."""

    def read(self, entry: ObjectEntry, now_s: float) -> bytes:
        """Return the value of an entry. Raises SdoAbort."""
        ...

    def write(self, entry: ObjectEntry, raw: bytes, now_s: float) -> PendingWrite | None:
        """Write all bytes of an entry. Return the write to wait for; None if it is done. Raises SdoAbort."""
        ...

    def log_rejected_write(
        self, address: EntryAddress, raw: bytes, abort_code: AbortCode, now_s: float
    ) -> None:
        """Log a rejected write. `raw` contains the bytes that were received."""
        ...

    def is_vent(self, entry: ObjectEntry, raw: bytes) -> bool:
        """Return True if this write is a vent and nothing else. Raises SdoAbort if the value is invalid."""
        ...


@dataclass(slots=True)
class _Transfer:
    """Segmented transfer in progress. `data` is still to be sent (upload), or already received (download)."""

    entry: ObjectEntry
    multiplexer: bytes  #: index and sub-index
    upload: bool
    data: bytes
    deadline_s: float
    toggle: int = 0


@dataclass(slots=True)
class _DelayedResponse:
    """Response to a download that waits for a write of the parameter file."""

    multiplexer: bytes
    response: bytes
    write: PendingWrite


class SdoServer:
    """SDO server for one client. An error ends the transfer, and nothing is written."""

    def __init__(self, store: EntryStore) -> None:
        self._store = store
        self._transfer: _Transfer | None = None
        self._delayed: _DelayedResponse | None = None
        self._services: Mapping[int, Callable[[bytes, float], bytes]] = {
            0: self._download_segment,
            _DOWNLOAD: self._download,
            2: self._upload,
            3: self._upload_segment,
        }

    def handle(self, request: bytes, now_s: float) -> bytes | None:
        """Return the response to a request.

        Returns b"" for an abort by the client, and if `tick` returns the response later. Returns None for
        data that is not an SDO request. A new request cancels a response that `tick` has not yet returned.
        """
        if len(request) != _REQUEST_BYTES:
            return None
        self._delayed = None
        specifier = request[0] >> 5
        if specifier == 4:
            self._transfer = None
            return b""
        is_segment, transfer = specifier in (0, 3), self._transfer
        if not is_segment:
            multiplexer = request[1:4]
        else:
            multiplexer = transfer.multiplexer if transfer else _NO_MULTIPLEXER
        try:
            if specifier not in self._services:
                raise SdoAbort(AbortCode.COMMAND)
            return self._services[specifier](request, now_s)
        except SdoAbort as abort:
            if specifier == _DOWNLOAD or (specifier == 0 and transfer and not transfer.upload):
                raw = transfer.data if is_segment and transfer else _initial_data(request)
                self._store.log_rejected_write(_address_of(multiplexer), raw, abort.abort_code, now_s)
            return self._abort(multiplexer, abort.abort_code)

    def is_vent(self, request: bytes) -> bool:
        """Return True if a request is an expedited download that vents."""
        if len(request) != _REQUEST_BYTES or request[0] >> 5 != _DOWNLOAD or not request[0] & _EXPEDITED:
            return False
        try:
            entry = _entry_of(request)
            return self._store.is_vent(entry, _expedited_data(request, entry.type.size))
        except SdoAbort:
            return False

    def tick(self, now_s: float) -> bytes | None:
        """Return a response whose write has finished, or the abort message for a transfer that has timed out.

        Returns None if there is nothing to send.
        """
        if self._delayed is not None and self._delayed.write.succeeded is not None:
            delayed, self._delayed = self._delayed, None
            if delayed.write.succeeded:
                return delayed.response
            return self._abort(delayed.multiplexer, AbortCode.HARDWARE)
        if self._transfer is None or now_s <= self._transfer.deadline_s:
            return None
        return self._abort(self._transfer.multiplexer, AbortCode.TIMEOUT)

    def _abort(self, multiplexer: bytes, abort_code: AbortCode) -> bytes:
        self._transfer = None
        return b"\x80" + multiplexer + struct.pack("<I", abort_code.code)

    def _upload(self, request: bytes, now_s: float) -> bytes:
        self._transfer = None
        multiplexer, entry = request[1:4], _entry_of(request)
        data = self._store.read(entry, now_s)
        if 0 < len(data) <= 4:
            return bytes((0x43 | 4 - len(data) << 2,)) + multiplexer + data.ljust(4, b"\0")
        self._transfer = _Transfer(entry, multiplexer, True, data, now_s + TIMEOUT_S)
        return b"\x41" + multiplexer + struct.pack("<I", len(data))

    def _upload_segment(self, request: bytes, now_s: float) -> bytes:
        transfer = self._next_segment(request, now_s, upload=True)
        segment, transfer.data = transfer.data[:_SEGMENT_BYTES], transfer.data[_SEGMENT_BYTES:]
        last = not transfer.data
        if last:
            self._transfer = None
        head = request[0] & 0x10 | _SEGMENT_BYTES - len(segment) << 1 | last
        return bytes((head,)) + segment.ljust(_SEGMENT_BYTES, b"\0")

    def _download(self, request: bytes, now_s: float) -> bytes:
        self._transfer = None
        multiplexer, entry = request[1:4], _entry_of(request)
        if not entry.writable:
            raise SdoAbort(_not_writable(entry))
        response = b"\x60" + multiplexer + bytes(4)
        if request[0] & _EXPEDITED:
            write = self._store.write(entry, _expedited_data(request, entry.type.size), now_s)
            return self._after(write, multiplexer, response)
        size_indicated = request[0] & _SIZE_INDICATED
        size = int.from_bytes(request[4:], "little") if size_indicated else entry.type.size
        if size != entry.type.size:
            raise SdoAbort(AbortCode.TOO_LONG if size > entry.type.size else AbortCode.TOO_SHORT)
        self._transfer = _Transfer(entry, multiplexer, False, b"", now_s + TIMEOUT_S)
        return response

    def _download_segment(self, request: bytes, now_s: float) -> bytes:
        transfer = self._next_segment(request, now_s, upload=False)
        transfer.data += request[1 : 1 + _SEGMENT_BYTES - (request[0] >> 1 & 7)]
        if len(transfer.data) > transfer.entry.type.size:
            raise SdoAbort(AbortCode.TOO_LONG)
        response = bytes((0x20 | request[0] & 0x10,)) + bytes(_SEGMENT_BYTES)
        if not request[0] & 1:
            return response
        self._transfer = None
        write = self._store.write(transfer.entry, transfer.data, now_s)
        return self._after(write, transfer.multiplexer, response)

    def _after(self, write: PendingWrite | None, multiplexer: bytes, response: bytes) -> bytes:
        """Return the response, or b"" if `tick` returns the response when the write has finished."""
        self._delayed = _DelayedResponse(multiplexer, response, write) if write else None
        return b"" if write else response

    def _next_segment(self, request: bytes, now_s: float, *, upload: bool) -> _Transfer:
        """Return the transfer to which a segment belongs.

        Raises SdoAbort if there is no such transfer, or if the toggle bit is wrong.
        """
        transfer = self._transfer
        if transfer is None or transfer.upload != upload:
            raise SdoAbort(AbortCode.COMMAND)
        if request[0] >> 4 & 1 != transfer.toggle:
            raise SdoAbort(AbortCode.TOGGLE)
        transfer.toggle ^= 1
        transfer.deadline_s = now_s + TIMEOUT_S
        return transfer


def _expedited_data(request: bytes, size: int) -> bytes:
    """Return the data of an expedited download. `size` is its length if the request does not state it."""
    length = 4 - (request[0] >> 2 & 3) if request[0] & _SIZE_INDICATED else size
    return request[4 : 4 + length]


def _initial_data(request: bytes) -> bytes:
    """Return the data in a request that begins a download; empty if segments follow."""
    if not request[0] & _EXPEDITED:
        return b""
    entry = entry_at(*_address_of(request[1:4]))
    return _expedited_data(request, entry.type.size if entry else 4)


def _address_of(multiplexer: bytes) -> EntryAddress:
    index, subindex = struct.unpack("<HB", multiplexer)
    return index, subindex


def _entry_of(request: bytes) -> ObjectEntry:
    return find_entry(*_address_of(request[1:4]))


def _not_writable(entry: ObjectEntry) -> AbortCode:
    """Return the abort code of a write to a read-only entry.

    python-canopen tolerates a fixed number of mapped objects only if its write is "read-only".
    """
    is_mapped_object = entry.index in PDO_MAPPINGS and entry.subindex
    return AbortCode.UNSUPPORTED_ACCESS if is_mapped_object else AbortCode.READ_ONLY
