"""Audit logger between the buses and the instrument: logs writes, commands and changes of state."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Hashable, Mapping
from typing import Any, Protocol

from pneuforce.instrument.audit.changes import ObservedState, changes
from pneuforce.instrument.audit.event_throttle import AuditEvent, EventThrottle
from pneuforce.instrument.audit.record import AuditRecord, RecordFields, Timestamp
from pneuforce.instrument.core.command_block import CommandBlock
from pneuforce.instrument.core.event_counts import EventCounts
from pneuforce.instrument.core.event_log_head import EventLogHead
from pneuforce.instrument.core.lease import Peer
from pneuforce.instrument.core.reject_reason import RejectReason
from pneuforce.instrument.core.session import Session
from pneuforce.instrument.core.snapshot import Snapshot, state_of, writable_values
from pneuforce.support.call_guard import CallGuard
from pneuforce.support.rejected_write import RejectedWrite, RejectedWriteLogger

log = logging.getLogger("pneuforce")

DUE_INTERVAL_S = 1.0  #: interval at which the reports that are due are taken from the event throttle
ALARM_HOLD_S = 1.0  #: shortest duration of an alarm: a force that varies around its limit causes one alarm


class AuditSink(Protocol):
    """Destination of the audit records."""

    @property
    def write_error(self) -> str:
        """Return why records cannot be written now. The string is empty if there is no error."""
        ...

    def append(self, record: AuditRecord) -> None:
        """Append a record. This method never blocks and never raises."""
        ...

    @property
    def head(self) -> EventLogHead:
        """Return the head of the records on the disk."""
        ...


class NullAuditSink:
    """Sink that discards all records, for an instrument without an event log."""

    write_error = ""
    head = EventLogHead()

    def append(self, record: AuditRecord) -> None:
        """Discard the record."""


class AuditLogger:
    """`Source` that passes each write to the session, and logs its old value, new value and result.

    The host process calls `on_sample` and `tick` as for a bus server. In these calls the logger records the
    changes of the instrument that no write has caused, for example a trip.
    """

    def __init__(
        self,
        session: Session,
        sink: AuditSink,
        utc_us: Callable[[], int] = lambda: time.time_ns() // 1000,
    ) -> None:
        self.counts = EventCounts()
        self._session = session
        self._instrument = session.instrument
        self._sink = sink
        self._utc_us = utc_us
        self._throttle = EventThrottle()
        self._last = ObservedState(
            board=None, faults=(), state="boot", zero_kpa=None, force_alarm=False, force_alarm_2=False
        )
        self._alarm_until_s = self._alarm_2_until_s = 0.0
        self._next_due_s = 0.0
        self._guarded = CallGuard("a write was not logged because of a programming error")
        self._ended = False
        self._rejected_writes = RejectedWriteLogger(log)
        # Commands without an answer, by the name of the peer.
        self._pending_commands: dict[str, CommandBlock] = {}
        self._discrete_state: Hashable = None

    # ---- as a source

    @property
    def can_down(self) -> bool:
        """Return True if the CAN bus is down."""
        return self._instrument.can_down

    @can_down.setter
    def can_down(self, down: bool) -> None:
        self._instrument.can_down = down

    def snapshot(self, peer: Peer, now_s: float) -> Snapshot:
        """Return the values at one instant, as `peer` sees them."""
        return self._instrument.snapshot(peer, now_s)

    @property
    def discrete_state(self) -> Hashable:
        """Return a value that changes if a sample changes the state, the status or the faults."""
        return self._instrument.discrete_state

    @property
    def force_limit_exceeded(self) -> bool:
        """Return True if the latest sample raises the force alarm."""
        return self._instrument.force_limit_exceeded

    def write(self, peer: Peer, values: Mapping[str, Any], now_s: float) -> RejectReason:
        """Execute one write request and log it. Return the reject reason."""
        before = self._guarded(writable_values, self._instrument, peer, now_s) or {}
        reject_reason = self._session.write(peer, values, now_s)
        if reject_reason is not RejectReason.NONE:
            self.counts.count_rejected_write(str(reject_reason))
        self._guarded(self._log_write, peer, values, before, reject_reason, now_s)
        return reject_reason

    def _log_write(
        self,
        peer: Peer,
        values: Mapping[str, Any],
        before: Mapping[str, Any],
        reject_reason: RejectReason,
        now_s: float,
    ) -> None:
        old_and_new = {name: (before.get(name), value) for name, value in values.items()}
        accepted = reject_reason is RejectReason.NONE
        result = "accepted" if accepted else str(reject_reason)
        vent = values.get("mode") == "vent"
        event = AuditEvent(
            fields={"kind": "write", "who": _name_of(peer), "values": old_and_new, "result": result}
            | ({"vented": True} if vent and not accepted else {}),
            subject=tuple(values),
            key=(tuple(values.values()), result),
            grade="vent" if vent else "accepted" if accepted else "rejected",
            changed=accepted and any(_differs(name, *both) for name, both in old_and_new.items()),
        )
        self._append(self._throttle.filter(peer, event, self._timestamp(now_s)))
        if accepted and _differs("command_sequence", *old_and_new.get("command_sequence", (0, 0))):
            self._pending_commands[_name_of(peer)] = self._instrument.peers.last_command(peer)
        self._log_changes(now_s)

    def master_lost(self, now_s: float) -> None:
        """Report that the heartbeat of the CANopen master is missing."""
        self._session.master_lost(now_s)
        self._log_changes(now_s)

    def master_recovered(self, now_s: float) -> None:
        """Report that the heartbeat of the CANopen master has returned."""
        self._session.master_recovered(now_s)

    def log_rejected_write(self, peer: Peer, rejected: RejectedWrite, now_s: float) -> None:
        """Log a write request that the bus server rejected and did not pass to the instrument."""
        self.counts.count_rejected_write(rejected.reason)
        self._rejected_writes.log(peer, rejected, now_s)
        fields = {
            "kind": "request",
            "who": _name_of(peer),
            "request": rejected.request.hex(" "),
            "written": rejected.written,
            "allowed": rejected.allowed,
            "result": rejected.reason,
        }
        event = AuditEvent(fields, subject=rejected.request, key=rejected.reason, grade="rejected")
        self._append(self._throttle.filter(peer, event, self._timestamp(now_s)))

    def log_login(self, peer: Peer, kind: str, result: str, now_s: float) -> None:
        """Log a login or a logout of a user on the web page. The address of `peer` contains the name."""
        fields = {"kind": kind, "who": _name_of(peer), "result": result}
        event = AuditEvent(fields, subject=kind, key=result, grade="accepted", changed=True)
        self._append(self._throttle.filter(peer, event, self._timestamp(now_s)))

    def log_failed_logins(self, peer: Peer, reason: str, times: int, now_s: float, user: str = "") -> None:
        """Log that `peer` has failed to log in. `times` is the number of failed logins.

        `user` is the name that was sent; empty if it is unknown or not a name.
        """
        self.counts.count_failed_logins(peer, reason, times)
        fields = {"kind": "login", "who": _name_of(peer), "result": reason} | ({"user": user} if user else {})
        event = AuditEvent(fields, subject=("login", reason, user), key=reason, grade="rejected", times=times)
        self._append(self._throttle.filter(peer, event, self._timestamp(now_s)))

    # ---- as a server of the host process

    def on_sample(self, now_s: float) -> None:
        """Log changes of the instrument's state."""
        before, self._discrete_state = self._discrete_state, self._instrument.discrete_state
        if self._discrete_state != before or self._pending_commands:
            self._log_changes(now_s)

    def tick(self, now_s: float) -> None:
        """Log changes and due reports. Pass the head of the event log and its failure to the instrument."""
        self._instrument.log_down = bool(self._sink.write_error)
        self._instrument.event_log_head = self._sink.head
        self._log_changes(now_s)
        if now_s >= self._next_due_s:
            self._next_due_s = now_s + DUE_INTERVAL_S
            self._append(self._throttle.due(self._timestamp(now_s)))

    # ---- start and end

    def log_start(self, identity: RecordFields, now_s: float) -> None:
        """Log the start of the instrument with its identity."""
        self._append([AuditRecord(self._timestamp(now_s), {"kind": "start", **identity})])

    def end(self, why: str, now_s: float) -> None:
        """Log the events that were only counted, and that the instrument ends. Later calls do nothing."""
        if self._ended:
            return
        self._ended = True
        self._log_changes(now_s)
        at = self._timestamp(now_s)
        self._append([*self._throttle.flush(at), AuditRecord(at, {"kind": "stop", "why": why})])

    # ---- changes of the instrument

    def _log_changes(self, now_s: float) -> None:
        now = self._observe(now_s)
        if now != self._last:
            at = self._timestamp(now_s)
            self._append([AuditRecord(at, fields) for fields in changes(self._last, now)])
            self.counts.count_faults(self._last.faults, now.faults)
            self.counts.count_state(self._last.state, now.state)
            self._last = now
        if self._pending_commands:
            self._log_answers(now_s)

    def _observe(self, now_s: float) -> ObservedState:
        instrument = self._instrument
        hello, firmware, zero = instrument.hello, instrument.firmware, instrument.chain.zero
        if instrument.force_limit_exceeded:
            self._alarm_until_s = now_s + ALARM_HOLD_S
        if instrument.alarm_2.active:
            self._alarm_2_until_s = now_s + ALARM_HOLD_S
        return ObservedState(
            board=(hello.board, hello.serial, str(firmware)) if hello and firmware else self._last.board,
            faults=tuple(instrument.faults),
            state=state_of(instrument),
            zero_kpa=zero.zero_kpa if zero.taken else None,
            force_alarm=now_s < self._alarm_until_s,
            force_alarm_2=now_s < self._alarm_2_until_s,
        )

    def _log_answers(self, now_s: float) -> None:
        for who, block in list(self._pending_commands.items()):
            if block.answer_state != "busy":
                del self._pending_commands[who]
                result = "done" if block.answer_result is RejectReason.NONE else str(block.answer_result)
                fields = {"kind": "answer", "who": who, "command": block.code, "result": result}
                log.info(
                    "%s command %s: %s", who, block.code, result if result == "done" else f"failed, {result}"
                )
                self._append([AuditRecord(self._timestamp(now_s), fields)])

    def _timestamp(self, now_s: float) -> Timestamp:
        return Timestamp(self._utc_us(), now_s)

    def _append(self, records: list[AuditRecord]) -> None:
        for record in records:
            self._sink.append(record)


def _name_of(peer: Peer) -> str:
    return " ".join(peer).strip()


def _differs(name: str, old: Any, new: Any) -> bool:
    """Return True if a write changes a quantity. A command key is no change: each command needs a new key."""
    return name != "command_key" and old != new
