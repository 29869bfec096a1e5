"""Access to the values of the object dictionary: quantities, communication parameters, and node values."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from pneuforce.registers.can.command import CAN_PEER, write_command
from pneuforce.registers.can.frames import COMMAND, COMMAND_MODES
from pneuforce.registers.canopen.abort import SOURCE_REJECTED, AbortCode, SdoAbort
from pneuforce.registers.canopen.entry import EntryAddress, ObjectEntry
from pneuforce.registers.canopen.measuring_device import AUTOZERO, AUTOZERO_PRESSURE, AUTOZERO_SIGNATURE
from pneuforce.registers.canopen.node_values import ValueReader, field_address
from pneuforce.registers.canopen.object_dictionary import REGISTER_INDEX_BASE, entry_at
from pneuforce.registers.canopen.parameter_storage import PendingWrite
from pneuforce.registers.canopen.parameters import Parameters
from pneuforce.registers.canopen.rejected_sdo import rejected_sdo
from pneuforce.registers.map import BY_NAME
from pneuforce.registers.source import Source

_COMMAND_MODE = field_address(COMMAND, "mode")
_MODES = (_COMMAND_MODE, (REGISTER_INDEX_BASE + BY_NAME["mode"].address, 0))
_VENT = COMMAND_MODES.codes["vent"]
#: Reject reasons that depend on the client. The others depend on the state of the rig.
_LOCAL_CONTROL = frozenset(("lease", "write_protect"))


class ObjectStore:
    """Values of the object dictionary for the SDO server."""

    def __init__(
        self,
        source: Source,
        parameters: Parameters,
        value_readers: Mapping[EntryAddress, ValueReader],
    ) -> None:
        """Create the store. `value_readers` read the entries whose values the node itself supplies."""
        self._source = source
        self._parameters = parameters
        self._value_readers = value_readers
        #: Functions that are called after a write to a parameter. The argument is the time [s].
        self.on_write: dict[EntryAddress, Callable[[float], None]] = {}
        #: Functions that carry out a write to an entry that is not a parameter. The argument is the value.
        self.actions: dict[EntryAddress, Callable[[int], PendingWrite | None]] = {}

    def read(self, entry: ObjectEntry, now_s: float) -> bytes:
        """Return the value of an entry, taken from one snapshot. Raises SdoAbort if there is no value."""
        if not entry.readable:
            raise SdoAbort(AbortCode.WRITE_ONLY)
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

    def write(self, entry: ObjectEntry, raw: bytes, now_s: float) -> PendingWrite | None:
        """Write all bytes of an entry. Return the write of the parameter file that this write has started.

        Raises SdoAbort and changes nothing if the value is rejected.
        """
        value = self._decode(entry, raw)
        if entry.address in self.actions:
            return self.actions[entry.address](int(value))
        if entry.index >= REGISTER_INDEX_BASE:
            self._write_source(entry, value, now_s)
        else:
            self._parameters.set(entry.address, int(value))
        if entry.address in self.on_write:
            self.on_write[entry.address](now_s)
        return None

    def log_rejected_write(
        self, address: EntryAddress, raw: bytes, abort_code: AbortCode, now_s: float
    ) -> None:
        """Log a rejected write. Writes to communication parameters are not logged."""
        entry = entry_at(*address)
        is_register = entry is None or entry.index >= REGISTER_INDEX_BASE
        if is_register and abort_code not in SOURCE_REJECTED:  # the source logs its own rejections
            self._source.log_rejected_write(CAN_PEER, rejected_sdo(address, raw, abort_code, entry), now_s)

    def is_vent(self, entry: ObjectEntry, raw: bytes) -> bool:
        """Return True if this write is a vent and nothing else. Raises SdoAbort if the value is invalid."""
        return entry.address in _MODES and entry.decode(raw, self._parameters.options.node_id) == _VENT

    def _decode(self, entry: ObjectEntry, raw: bytes) -> float:
        value = entry.decode(raw, self._parameters.options.node_id)
        if entry.index == _COMMAND_MODE[0] and not (entry.address == _COMMAND_MODE and value == _VENT):
            # An SDO writes a single field, but a Command needs all its fields. Only mode := vent is allowed.
            raise SdoAbort(AbortCode.NOT_STORED)
        if entry.index == AUTOZERO and (entry.address, value) != (AUTOZERO_PRESSURE, AUTOZERO_SIGNATURE):
            raise SdoAbort(AbortCode.NOT_STORED)
        return value

    def _write_source(self, entry: ObjectEntry, value: float, now_s: float) -> None:
        if entry.address == _COMMAND_MODE:
            self._source.write(CAN_PEER, {"mode": "vent"}, now_s)
            return
        if entry.index == AUTOZERO:
            reject_reason = self._zero_pressure(now_s)
        else:
            assert entry.field is not None, "any other writable entry of this area is a register"
            written = {entry.field.quantity: entry.field.decode(value)}
            reject_reason = self._source.write(CAN_PEER, written, now_s)
        if reject_reason != "none":
            client_related = reject_reason in _LOCAL_CONTROL
            raise SdoAbort(AbortCode.LOCAL_CONTROL if client_related else AbortCode.DEVICE_STATE)

    def _zero_pressure(self, now_s: float) -> str:
        """Run the zero adjustment and return its reject reason. The zero adjustment takes no time."""
        reject_reason = write_command(self._source, "zero_pressure", now_s)
        answer = self._source.snapshot(CAN_PEER, now_s)
        command_failed = reject_reason == "none" and answer.answer_state == "failed"
        return str(answer.answer_result) if command_failed else reject_reason
