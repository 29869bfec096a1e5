"""Handler for the Command frame: checks the frame, carries it out, and determines the result."""

from __future__ import annotations

from typing import Any, NamedTuple

from pneuforce.registers.can.frames import COMMAND, COMMAND_MODES, REJECTED, RESULTS, decode
from pneuforce.registers.can.rejected_command import rejected_command
from pneuforce.registers.codes import REJECT_REASONS
from pneuforce.registers.map import COMMAND_KEY
from pneuforce.registers.source import Peer, Source

CAN_PEER = Peer("can")
OTHER_COMMAND = "another Command had this sequence number: use a new sequence number"
OLD_HOLD = (
    "this hold is older than the last vent: find out why the rig was vented, then vent and send a new hold"
)
NO_LEASE = "the lease of this hold has ended: vent and send a new hold"
_SEQUENCE_OFFSET = next(offset for offset, field in COMMAND.field_offsets if field.name == "sequence")


def is_vent_command(data: bytes) -> bool:
    """Return True if `data` is a Command with mode vent. A vent is never rejected."""
    return len(data) == COMMAND.length and COMMAND.codes(data)["mode"] == COMMAND_MODES.codes["vent"]


def write_command(source: Source, code: str, now_s: float) -> str:
    """Write a command with a new sequence number and return the reject reason of the write.

    The result of the command itself is the answer in the next snapshot.
    """
    command = {
        "command_key": COMMAND_KEY,
        "command_code": code,
        "command_argument": 0,
        # The source carries out a command only if its sequence number differs from the last number. The SDO
        # server also writes this number, so the last number is read from the snapshot.
        "command_sequence": (source.snapshot(CAN_PEER, now_s).command_sequence + 1) & 0xFFFF,
    }
    return source.write(CAN_PEER, command, now_s)


class CommandResult(NamedTuple):
    """Content of the Answer frame."""

    sequence: int
    result: str  #: a name of RESULTS


class CommandHandler:
    """Handler that checks length, range and sequence of a Command, in this order, and carries it out.

    A vent of full length is carried out even if the range or the sequence is invalid. A lease is written each
    time, whatever its sequence number, because its repetition does nothing else.

    All nodes of the bus are one peer, because a Command does not name its sender. If one node repeats its
    hold to renew a lease, and another node vents, the next repetition would be a new hold. Therefore a hold
    that is equal to one from before the last vent is rejected as "sequence_reused".

    The source logs the writes that it rejects. The handler logs the Commands that it rejects itself.
    """

    def __init__(self, source: Source) -> None:
        self._source = source
        self._last = b""
        self._last_result = ""
        self._holds: dict[int, bytes] = {}  # holds since the last vent, by sequence
        self._ended_holds: dict[int, bytes] = {}  # holds before the last vent
        self._busy: int | None = None  #: sequence of a Command that is not finished yet

    def handle(self, data: bytes, now_s: float) -> CommandResult | None:
        """Carry out one Command and return its result, or None if `finished_result` returns it later."""
        if len(data) != COMMAND.length:
            sequence = data[_SEQUENCE_OFFSET] if len(data) > _SEQUENCE_OFFSET else 0
            return CommandResult(sequence, self._reject(data, "invalid_length", now_s))
        values = decode(COMMAND, data)
        sequence = data[_SEQUENCE_OFFSET]
        if values["mode"] == "vent":
            return CommandResult(sequence, self._vent(data, values, now_s))
        if not _in_range(data):
            return CommandResult(sequence, self._reject(data, "out_of_range", now_s))
        if values["mode"] == "lease":  # not stored as the last Command, which can still be repeated
            written = {"lease_s": values["lease"]}
            return CommandResult(sequence, _result(self._source.write(CAN_PEER, written, now_s)))
        if data == self._ended_holds.get(sequence):
            return CommandResult(sequence, self._reject(data, "sequence_reused", now_s, OLD_HOLD))
        if self._last and sequence == self._last[_SEQUENCE_OFFSET]:
            result = self._repeat(data, values, now_s)
            is_unfinished = result == "renewed" and sequence == self._busy
            return None if is_unfinished else CommandResult(sequence, result)
        if values["mode"] == "hold":
            self._holds[sequence] = data
        result = self._execute(values, now_s)
        self._last, self._last_result = data, result
        if result == "accepted" and values["mode"] != "hold" and self._is_busy(sequence, now_s):
            return None
        return CommandResult(sequence, self._last_result)

    def finished_result(self, snapshot: Any) -> CommandResult | None:
        """Return the result of a Command that has just finished; None if no Command has finished."""
        if self._busy is None or snapshot.answer_state == "busy":
            return None
        sequence, self._busy = self._busy, None
        result = _command_block_result(snapshot)
        if self._last[_SEQUENCE_OFFSET] == sequence:
            self._last_result = result
        return CommandResult(sequence, result)

    def _vent(self, data: bytes, values: dict[str, Any], now_s: float) -> str:
        """Vent. Also write setpoint and lease if all fields are within their ranges. Return the result."""
        repeated = data == self._last
        written = {"mode": "vent"} | (_setpoint_and_lease(values) if _in_range(data) else {})
        self._source.write(CAN_PEER, written, now_s)
        self._last, self._last_result = data, "accepted"
        if self._holds:
            self._ended_holds, self._holds = self._holds, {}
        return "renewed" if repeated else "accepted"

    def _execute(self, values: dict[str, Any], now_s: float) -> str:
        if values["mode"] == "hold":
            return _result(
                self._source.write(CAN_PEER, {"mode": "hold"} | _setpoint_and_lease(values), now_s)
            )
        return _result(write_command(self._source, values["mode"], now_s))

    def _is_busy(self, sequence: int, now_s: float) -> bool:
        snapshot = self._source.snapshot(CAN_PEER, now_s)
        if snapshot.answer_state == "busy":
            self._busy = sequence
            return True
        self._last_result = _command_block_result(snapshot)
        return False

    def _repeat(self, data: bytes, values: dict[str, Any], now_s: float) -> str:
        """Return the result of a Command that has the same sequence as the last Command.

        If all bytes are the same, only the lease is renewed. A hold that is no longer in effect is rejected.
        """
        if data != self._last:
            return self._reject(data, "sequence_reused", now_s, OTHER_COMMAND)
        if self._last_result != "accepted":
            return self._last_result
        snapshot = self._source.snapshot(CAN_PEER, now_s)
        is_hold, holder = values["mode"] == "hold", snapshot.lease_holder
        lease_lost = is_hold and values["lease"] > 0 and holder != CAN_PEER.channel
        if (is_hold and snapshot.faults) or (lease_lost and holder != "none"):
            return self._execute(values, now_s)  # the source rejects the hold, and logs the reason
        if lease_lost:
            self._reject(data, "state", now_s, NO_LEASE)
            return _result("state")
        if holder == CAN_PEER.channel:
            return _result(self._source.write(CAN_PEER, {"lease_s": snapshot.lease_s}, now_s), "renewed")
        return "renewed"

    def _reject(self, data: bytes, reason: str, now_s: float, remedy: str = "") -> str:
        """Log a Command that is not passed to the source, and return the reason."""
        self._source.log_rejected_write(CAN_PEER, rejected_command(data, reason, remedy), now_s)
        return reason


def _in_range(data: bytes) -> bool:
    codes = COMMAND.codes(data)
    setpoint_missing = codes["mode"] == COMMAND_MODES.codes["hold"] and not codes["setpoint"]
    return not setpoint_missing and all(field.accepts(codes[field.name]) for field in COMMAND.fields)


def _setpoint_and_lease(values: dict[str, Any]) -> dict[str, Any]:
    setpoint = {"setpoint_requested_kpa": values["setpoint"]} if values["setpoint"] else {}
    return setpoint | {"lease_s": values["lease"], "proof_test": values["proof_test"]}


def _result(reject_reason: str, accepted: str = "accepted") -> str:
    code = REJECT_REASONS.codes[reject_reason]
    return RESULTS.names[REJECTED + code] if code else accepted


def _command_block_result(snapshot: Any) -> str:
    return _result(snapshot.answer_result if snapshot.answer_state == "failed" else "none")
