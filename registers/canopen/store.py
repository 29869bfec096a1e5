"""What stands behind the dictionary: quantities of the source, parameters, and the node's own values."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from registers.can.command import CAN
from registers.can.frames import COMMAND, COMMAND_MODES
from registers.canopen.abort import Abort, Why
from registers.canopen.communication import ERROR_FIELD, RECORDS
from registers.canopen.dictionary import REGISTERS_AT
from registers.canopen.entry import Entry
from registers.canopen.parameters import Parameters, Place
from registers.canopen.readings import Reading
from registers.map import BY_NAME
from registers.source import Source

_COMMAND_MODE = RECORDS[COMMAND.name], 1 + [field.name for field in COMMAND.fields].index("mode")
_MODES = (_COMMAND_MODE, (REGISTERS_AT + BY_NAME["mode"].address, 0))
_VENT = COMMAND_MODES.codes["vent"]
#: Refusals that are about who asks; the others are about the state of the rig.
_LOCAL_CONTROL = frozenset(("lease", "write_lock"))


class Store:
    """Reads and writes entries for the SDO server."""

    def __init__(
        self, source: Source, parameters: Parameters, node_id: int, own: Mapping[Place, Reading]
    ) -> None:
        """`own` are the values that the node makes."""
        self._source = source
        self._parameters = parameters
        self._node_id = node_id
        self._own = own
        #: What is to happen when a place is written, after it was stored.
        self.on_write: dict[Place, Callable[[float], None]] = {}

    def read(self, entry: Entry, now_s: float) -> bytes:
        """Its value, all of one instant. Raises Abort: there is none."""
        if entry.at in self._own:
            return entry.encode(self._own[entry.at](self._source.snapshot(CAN, now_s)))
        field = entry.field
        if field is None:
            return entry.encode(self._parameters[entry.at])
        if field.constant is not None:
            return entry.encode(field.constant)
        return entry.encode(field.encode(getattr(self._source.snapshot(CAN, now_s), field.quantity)))

    def check(self, entry: Entry, now_s: float) -> None:
        """See that it may be written at all. Raises Abort."""
        if not entry.writable:
            self._tell(entry, b"", Why.READ_ONLY, now_s)
            raise Abort(Why.READ_ONLY)

    def _tell(self, entry: Entry, raw: bytes, why: Why, now_s: float) -> None:
        """Have the source hear of what it will not be asked; the bus's own parameters do not concern it."""
        if entry.index >= REGISTERS_AT:
            request = entry.index.to_bytes(2, "little") + bytes((entry.sub,)) + raw
            self._source.refused(CAN, request, why.sentence, now_s)

    def write(self, entry: Entry, raw: bytes, now_s: float) -> None:
        """Write it whole. Raises Abort: refused, and nothing has changed."""
        try:
            code = self._accepted(entry, raw)
        except Abort as abort:
            self._tell(entry, raw, abort.why, now_s)
            raise
        if entry.index >= REGISTERS_AT:
            self._ask(entry, code, now_s)
        elif entry.at != ERROR_FIELD:
            self._parameters.set(entry.at, int(code))
        if entry.at in self.on_write:
            self.on_write[entry.at](now_s)

    def vents(self, entry: Entry, raw: bytes) -> bool:
        """Whether writing this asks for a vent and nothing else. Raises Abort: it cannot be written."""
        return entry.at in _MODES and entry.decode(raw, self._node_id) == _VENT

    def _accepted(self, entry: Entry, raw: bytes) -> float:
        code = entry.decode(raw, self._node_id)
        if entry.index == _COMMAND_MODE[0] and not (entry.at == _COMMAND_MODE and code == _VENT):
            raise Abort(Why.NOT_STORED)  # a Command is one PDO; no part of it is one, but for a vent
        return code

    def _ask(self, entry: Entry, code: float, now_s: float) -> None:
        if entry.at == _COMMAND_MODE:
            self._source.write(CAN, {"mode": "vent"}, now_s)
            return
        assert entry.field is not None, "what can be written up there is a register"
        refusal = self._source.write(CAN, {entry.field.quantity: entry.field.decode(code)}, now_s)
        if refusal != "none":
            raise Abort(Why.LOCAL_CONTROL if refusal in _LOCAL_CONTROL else Why.DEVICE_STATE)
