"""LSS slave without I/O (CiA 305, version 3.0): a master finds the node and configures its node id.

The node always has a node id, so that the services for nodes without a node id (fastscan) do not apply. The
bit rate belongs to the CAN interface of the computer, and cannot be changed.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping

from pneuforce.registers.can.command import CAN_PEER
from pneuforce.registers.canopen.communication import PRODUCT_CODE, VENDOR_ID, revision_number
from pneuforce.registers.canopen.parameter_storage import ParameterStorage, PendingWrite
from pneuforce.registers.source import Source

LSS_REQUEST_ID, LSS_RESPONSE_ID = 0x7E5, 0x7E4
#: Vendor id, product code, revision number and serial number (object 1018h).
LssAddress = tuple[int, int, int, int]

_REQUEST_BYTES = 8
_SWITCH_GLOBAL, _CONFIGURE_NODE_ID, _CONFIGURE_BIT_TIMING, _STORE = 0x04, 0x11, 0x13, 0x17
_SWITCH_SELECTIVE = range(0x40, 0x44)  #: four requests with one number of the address each
_SELECTED = 0x44  #: response to the last of these requests
#: Requests with vendor, product, lowest and highest revision, lowest and highest serial number.
_IDENTIFY = range(0x46, 0x4C)
_IDENTIFIED = 0x4F
_INQUIRE_ADDRESS = range(0x5A, 0x5E)
_INQUIRE_NODE_ID = 0x5E
_OUT_OF_RANGE = _NOT_SUPPORTED = 1
_ACCESS_ERROR = 2
#: Index in the table of CiA 301 → bit rate [bit/s].
_BIT_RATES = {0: 1_000_000, 1: 800_000, 2: 500_000, 3: 250_000, 4: 125_000, 6: 50_000, 7: 20_000, 8: 10_000}


class LssSlave:
    """LSS slave. A configured node id is `pending_node_id` until the node uses it after a reset."""

    def __init__(self, source: Source, bit_rate: int, storage: ParameterStorage) -> None:
        """Create the slave. Call `use_node_id` before the first request."""
        self.pending_node_id = self._active_node_id = 0
        self._bit_rate = bit_rate
        self._source = source
        self._storage = storage
        self._configuring = False
        self._received: dict[int, int] = {}  # numbers of "switch state selective" and "identify", by service
        self._write: PendingWrite | None = None
        self._services: Mapping[int, Callable[[bytes], bytes]] = {
            _CONFIGURE_NODE_ID: self._configure_node_id,
            _CONFIGURE_BIT_TIMING: self._configure_bit_timing,
            _STORE: self._store,
            _INQUIRE_NODE_ID: lambda _: bytes((self._active_node_id,)),
        }

    def use_node_id(self, node_id: int) -> None:
        """Record that the node uses this node id from now on. Another pending node id stays pending."""
        if self.pending_node_id == self._active_node_id:
            self.pending_node_id = node_id
        self._active_node_id = node_id

    def handle(self, request: bytes, now_s: float) -> bytes | None:
        """Return the response to a request; b"" if there is none, and None if the request is ignored."""
        if len(request) != _REQUEST_BYTES:
            return None
        service = request[0]
        if service == _SWITCH_GLOBAL:
            self._configuring = request[1] == 1 if request[1] in (0, 1) else self._configuring
            return b""
        if service in _SWITCH_SELECTIVE or service in _IDENTIFY:
            return self._compare(service, request, now_s)
        if not self._configuring:
            return b""
        if service in _INQUIRE_ADDRESS:
            number = self._address(now_s)[service - _INQUIRE_ADDRESS.start]
            return _response(service, struct.pack("<I", number))
        if service not in self._services:
            return None
        response = self._services[service](request)
        return _response(service, response) if response else b""

    def tick(self) -> bytes | None:
        """Return the response to "store configuration" when the file is written, otherwise None."""
        if self._write is None or self._write.succeeded is None:
            return None
        succeeded, self._write = self._write.succeeded, None
        return _response(_STORE, bytes((0 if succeeded else _ACCESS_ERROR,)))

    def _address(self, now_s: float) -> LssAddress:
        snapshot = self._source.snapshot(CAN_PEER, now_s)
        return VENDOR_ID, PRODUCT_CODE, revision_number(snapshot.map_hash), snapshot.serial_number

    def _compare(self, service: int, request: bytes, now_s: float) -> bytes:
        """Store one number of an address. After the last number, compare the address with the own one."""
        (self._received[service],) = struct.unpack_from("<I", request, 1)
        services = _SWITCH_SELECTIVE if service in _SWITCH_SELECTIVE else _IDENTIFY
        if service != services[-1]:
            return b""
        numbers = [self._received.pop(each, None) for each in services]
        if services is _SWITCH_SELECTIVE:
            if self._configuring or numbers != list(self._address(now_s)):
                return b""
            self._configuring = True
            return _response(_SELECTED)
        return _response(_IDENTIFIED) if _contains(numbers, self._address(now_s)) else b""

    def _configure_node_id(self, request: bytes) -> bytes:
        if not 1 <= request[1] <= 127:
            return bytes((_OUT_OF_RANGE,))
        self.pending_node_id = request[1]
        return bytes(1)

    def _configure_bit_timing(self, request: bytes) -> bytes:
        table, index = request[1], request[2]
        return bytes((0 if table == 0 and _BIT_RATES.get(index) == self._bit_rate else _NOT_SUPPORTED,))

    def _store(self, _: bytes) -> bytes:
        """Start to store the pending node id. Return b"" because the response follows later."""
        if not self._storage.can_store:
            return bytes((_NOT_SUPPORTED,))
        self._write = self._storage.store(self._storage.stored._replace(node_id=self.pending_node_id))
        return b"" if self._write else bytes((_ACCESS_ERROR,))


def _contains(numbers: list[int | None], address: LssAddress) -> bool:
    """Return True if an address is in the range of an "identify" request, and no number is missing."""
    if None in numbers:
        return False
    vendor, product, *ranges = (number or 0 for number in numbers)
    revision_low, revision_high, serial_low, serial_high = ranges
    in_range = revision_low <= address[2] <= revision_high and serial_low <= address[3] <= serial_high
    return (vendor, product) == address[:2] and in_range


def _response(service: int, data: bytes = b"") -> bytes:
    return (bytes((service,)) + data).ljust(_REQUEST_BYTES, b"\0")
