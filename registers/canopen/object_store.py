"""Access to the values of the object dictionary: quantities, communication parameters, and node values."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping

from pneuforce.registers.can.command import CAN_PEER
from pneuforce.registers.can.frames import COMMAND, COMMAND_MODES
from pneuforce.registers.canopen.abort import AbortCode, SdoAbort
from pneuforce.registers.canopen.communication import ERROR_FIELD
from pneuforce.registers.canopen.entry import EntryAddress, ObjectEntry
from pneuforce.registers.canopen.node_values import ValueReader, field_address
from pneuforce.registers.canopen.object_dictionary import REGISTER_INDEX_BASE
from pneuforce.registers.canopen.parameters import Parameters
from pneuforce.registers.map import BY_NAME
from pneuforce.registers.source import Source
from pneuforce.support.rejected_write import RejectedWrite

_COMMAND_MODE = field_address(COMMAND, "mode")
_MODES = (_COMMAND_MODE, (REGISTER_INDEX_BASE + BY_NAME["mode"].address, 0))
_VENT = COMMAND_MODES.codes["vent"]
#: Reject reasons that depend on the client. The others depend on the state of the rig.
_VALUE_REJECTED = (AbortCode.TOO_LOW, AbortCode.TOO_HIGH, AbortCode.INVALID_VALUE)
_LOCAL_CONTROL = frozenset(("lease", "write_protect"))


class ObjectStore:
    """Values of the object dictionary for the SDO server."""

    def __init__(
        self,
        source: Source,
        parameters: Parameters,
        node_id: int,
        value_readers: Mapping[EntryAddress, ValueReader],
    ) -> None:
        """Create the store. `value_readers` read the entries whose values the node itself supplies."""
        self._source = source
        self._parameters = parameters
        self._node_id = node_id
        self._value_readers = value_readers
        #: Functions that are called after a write to an entry. The argument is the time [s].
        self.on_write: dict[EntryAddress, Callable[[float], None]] = {}

    def read(self, entry: ObjectEntry, now_s: float) -> bytes:
        """Return the value of an entry, taken from one snapshot. Raises SdoAbort if there is no value."""
        if entry.address in self._value_readers:
            snapshot = self._source.snapshot(CAN_PEER, now_s)
            return entry.encode(self._value_readers[entry.address](snapshot))
        field = entry.field
        if field is None:
            return entry.encode(self._parameters[entry.address])
        if field.constant is not None:
            return entry.encode(field.constant)
        snapshot = self._source.snapshot(CAN_PEER, now_s)
        return entry.encode(field.encode(getattr(snapshot, field.quantity)))

    def check_writable(self, entry: ObjectEntry, now_s: float) -> None:
        """Raise SdoAbort if the entry is read-only."""
        if not entry.writable:
            self._log_rejected(entry, b"", AbortCode.READ_ONLY, now_s)
            raise SdoAbort(AbortCode.READ_ONLY)

    def _log_rejected(self, entry: ObjectEntry, raw: bytes, abort_code: AbortCode, now_s: float) -> None:
        """Log a rejected write to a register. Communication parameters are not logged."""
        if entry.index >= REGISTER_INDEX_BASE:
            request = entry.index.to_bytes(2, "little") + bytes((entry.subindex,)) + raw
            name = entry.field.name if entry.field else entry.name
            written = f"object {entry.index:04X}h:{entry.subindex}, {name} {raw[::-1].hex()}h"
            allowed = ""
            if entry.field and len(raw) == entry.type.size:
                (code,) = struct.unpack(entry.type.layout, raw)
                written = f"object {entry.index:04X}h:{entry.subindex}, {entry.field.describe(code)}"
                if abort_code in _VALUE_REJECTED:
                    allowed = f"{name} {entry.field.allowed_values}"
            rejected = RejectedWrite(request, abort_code.meaning, written, allowed)
            self._source.log_rejected_write(CAN_PEER, rejected, now_s)

    def write(self, entry: ObjectEntry, raw: bytes, now_s: float) -> None:
        """Write all bytes of an entry. Raises SdoAbort and changes nothing if the value is rejected."""
        try:
            value = self._decode(entry, raw)
        except SdoAbort as abort:
            self._log_rejected(entry, raw, abort.abort_code, now_s)
            raise
        if entry.index >= REGISTER_INDEX_BASE:
            self._write_source(entry, value, now_s)
        elif entry.address != ERROR_FIELD:
            self._parameters.set(entry.address, int(value))
        if entry.address in self.on_write:
            self.on_write[entry.address](now_s)

    def is_vent(self, entry: ObjectEntry, raw: bytes) -> bool:
        """Return True if this write is a vent and nothing else. Raises SdoAbort if the value is invalid."""
        return entry.address in _MODES and entry.decode(raw, self._node_id) == _VENT

    def _decode(self, entry: ObjectEntry, raw: bytes) -> float:
        value = entry.decode(raw, self._node_id)
        if entry.index == _COMMAND_MODE[0] and not (entry.address == _COMMAND_MODE and value == _VENT):
            # An SDO writes a single field, but a Command needs all its fields. Only mode := vent is allowed.
            raise SdoAbort(AbortCode.NOT_STORED)
        return value

    def _write_source(self, entry: ObjectEntry, value: float, now_s: float) -> None:
        if entry.address == _COMMAND_MODE:
            self._source.write(CAN_PEER, {"mode": "vent"}, now_s)
            return
        assert entry.field is not None, "a writable entry of this area is a register"
        written = {entry.field.quantity: entry.field.decode(value)}
        reject_reason = self._source.write(CAN_PEER, written, now_s)
        if reject_reason != "none":
            client_related = reject_reason in _LOCAL_CONTROL
            raise SdoAbort(AbortCode.LOCAL_CONTROL if client_related else AbortCode.DEVICE_STATE)
