"""The Command frame: whether it is well formed, new, and what becomes of it."""

from __future__ import annotations

from typing import Any, NamedTuple

from registers.can.frames import COMMAND, COMMAND_MODES, REFUSED, RESULTS, decode
from registers.codes import REFUSALS
from registers.map import COMMAND_KEY
from registers.source import Peer, Source

CAN = Peer("can")
#: Results of a Command that never reached the source.
MALFORMED = frozenset(("length", "span", "sequence"))
_SEQUENCE_AT = next(at for at, field in COMMAND.placed if field.name == "sequence")


def vents(data: bytes) -> bool:
    """Whether a Command with these bytes asks for a vent, which nothing refuses."""
    return len(data) == COMMAND.length and COMMAND.codes(data)["mode"] == COMMAND_MODES.codes["vent"]


class Reply(NamedTuple):
    """What the Answer frame has to say."""

    sequence: int
    result: str  #: a name of RESULTS


class CommandDesk:
    """Takes Commands in the order length, span, sequence. A vent is carried out whatever else is wrong."""

    def __init__(self, source: Source) -> None:
        self._source = source
        self._last = b""
        self._last_result = ""
        self._busy: int | None = None  #: sequence of a Command whose order takes time

    def take(self, data: bytes, now_s: float) -> Reply | None:
        """Carry out one Command; None where the answer comes later, from `ended`."""
        if len(data) != COMMAND.length:
            return Reply(data[_SEQUENCE_AT] if len(data) > _SEQUENCE_AT else 0, "length")
        values = decode(COMMAND, data)
        sequence = data[_SEQUENCE_AT]
        if values["mode"] == "vent":
            return Reply(sequence, self._vent(data, values, now_s))
        if not _in_span(data):
            return Reply(sequence, "span")
        if self._last and sequence == self._last[_SEQUENCE_AT]:
            return Reply(sequence, self._again(data, values, now_s))
        result = self._new(values, now_s)
        self._last, self._last_result = data, result
        if result == "accepted" and values["mode"] != "hold" and self._still_busy(sequence, now_s):
            return None
        return Reply(sequence, self._last_result)

    def ended(self, snapshot: Any) -> Reply | None:
        """The answer to an order that took time and has now ended."""
        if self._busy is None or snapshot.answer_state == "busy":
            return None
        sequence, self._busy = self._busy, None
        result = _result_of_order(snapshot)
        if self._last[_SEQUENCE_AT] == sequence:
            self._last_result = result
        return Reply(sequence, result)

    def _vent(self, data: bytes, values: dict[str, Any], now_s: float) -> str:
        """Vent; setpoint and lease are stored where they may be, and are no reason not to vent."""
        repeated = data == self._last
        stored = {"mode": "vent"} | (_setpoint_and_lease(values) if _in_span(data) else {})
        self._source.write(CAN, stored, now_s)
        self._last, self._last_result = data, "accepted"
        return "renewed" if repeated else "accepted"

    def _new(self, values: dict[str, Any], now_s: float) -> str:
        if values["mode"] == "hold":
            return _result(self._source.write(CAN, {"mode": "hold"} | _setpoint_and_lease(values), now_s))
        order = {
            "command_key": COMMAND_KEY,
            "command_code": values["mode"],
            "command_argument": 0,
            # one block serves all buses: only a number that differs from the last one makes it run
            "command_sequence": (self._source.snapshot(CAN, now_s).command_sequence + 1) & 0xFFFF,
        }
        return _result(self._source.write(CAN, order, now_s))

    def _still_busy(self, sequence: int, now_s: float) -> bool:
        snapshot = self._source.snapshot(CAN, now_s)
        if snapshot.answer_state == "busy":
            self._busy = sequence
            return True
        self._last_result = _result_of_order(snapshot)
        return False

    def _again(self, data: bytes, values: dict[str, Any], now_s: float) -> str:
        """A sequence that was the last one's: its repetition renews the lease and does nothing else."""
        if data != self._last:
            return "sequence"
        if self._last_result != "accepted":
            return self._last_result
        snapshot = self._source.snapshot(CAN, now_s)
        if snapshot.lease_holder == CAN.channel:
            return _result(self._source.write(CAN, {"lease_s": snapshot.lease_s}, now_s), "renewed")
        lost = values["mode"] == "hold" and values["lease"] > 0
        return _result("lease") if lost else "renewed"


def _in_span(data: bytes) -> bool:
    codes = COMMAND.codes(data)
    aimless = codes["mode"] == COMMAND_MODES.codes["hold"] and not codes["setpoint"]
    return not aimless and all(field.accepts(codes[field.name]) for field in COMMAND.fields)


def _setpoint_and_lease(values: dict[str, Any]) -> dict[str, Any]:
    setpoint = {"setpoint_requested_kpa": values["setpoint"]} if values["setpoint"] else {}
    return setpoint | {"lease_s": values["lease"]}


def _result(refusal: str, accepted: str = "accepted") -> str:
    code = REFUSALS.codes[refusal]
    return RESULTS.names[REFUSED + code] if code else accepted


def _result_of_order(snapshot: Any) -> str:
    return _result(snapshot.answer_result if snapshot.answer_state == "failed" else "none")
