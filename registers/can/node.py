"""CAN node in raw mode, without I/O: returns due frames, and handles received frames.

Time is an argument of each method.
"""

from __future__ import annotations

import math
from collections.abc import Hashable
from dataclasses import dataclass
from typing import Any

from pneuforce.registers.can.command import (
    CAN_PEER,
    CommandHandler,
    CommandResult,
    is_vent_command,
)
from pneuforce.registers.can.force_decimator import ForceDecimator
from pneuforce.registers.can.frames import (
    ANSWER,
    COMMAND,
    EMERGENCY,
    FORCE,
    GENERIC_ERROR,
    HEARTBEAT,
    IDENTITY,
    NO_ERROR,
    RIG_ERROR,
    STATE,
    STATUS_FRAME,
    FrameDefinition,
    encode,
    transmit_ids,
)
from pneuforce.registers.can.options import CanOptions
from pneuforce.registers.can.wire import CanFrame
from pneuforce.registers.source import Source

STALE_FORCE_PERIOD_S = 0.1  #: period of the Force frame while there are no samples
STATUS_INHIBIT_S = 0.01


@dataclass(slots=True)
class NodeCounters:
    """Counters of a node since its creation."""

    commands: int = 0  #: received Commands, valid or not
    ignored: int = 0  #: received frames that have an identifier of this node but no effect


@dataclass(slots=True)
class TransmitTimer:
    """Timer for a frame that is due after each period and at each change, but not within the inhibit time."""

    period_s: float
    inhibit_s: float = 0.0
    _sent_s: float = -math.inf
    _next_s: float = -math.inf
    _content: Hashable = None

    def due(self, now_s: float, content: Hashable = None) -> bool:
        """Return True if the frame must be sent now. `content` is compared with the last content sent."""
        period_over = now_s >= self._next_s
        changed = content != self._content and now_s >= self._sent_s + self.inhibit_s
        if not (period_over or changed):
            return False
        late = not now_s - self._next_s <= self.period_s
        self._next_s = now_s + self.period_s if changed or late else self._next_s + self.period_s
        self._sent_s, self._content = now_s, content
        return True


class CanNode:
    """CAN node of one source: returns the frames to send and handles the frames received."""

    def __init__(self, source: Source, options: CanOptions) -> None:
        self.options = options
        self.counters = NodeCounters()
        self.transmit_ids = transmit_ids(options.node_id)
        self._source = source
        self._command_handler = CommandHandler(source)
        self._command_id = COMMAND.base_id + options.node_id
        self._counter = 0
        self._decimator = ForceDecimator(options.force_rate_hz)
        self._stale_force_timer = TransmitTimer(STALE_FORCE_PERIOD_S)
        self._state_timer = TransmitTimer(STATE.period_s)
        self._status_timer = TransmitTimer(STATUS_FRAME.period_s, STATUS_INHIBIT_S)
        self._heartbeat_timer = TransmitTimer(HEARTBEAT.period_s)
        self._identity_timer = TransmitTimer(IDENTITY.period_s)
        self._booted = False
        self._faults: tuple[int, ...] = ()
        self._discrete_state: Hashable = None

    # ---- sending

    def on_sample(self, now_s: float) -> list[CanFrame]:
        """Return the frames due at a new sample: Force at its rate or with an alarm, and changed frames.

        The first frame of a node is its boot_up (CiA 301).
        """
        boot = [] if self._booted else self._heartbeat(now_s)
        selected = self._decimator.selects(alarm=self._source.force_limit_exceeded)
        before, self._discrete_state = self._discrete_state, self._source.discrete_state
        if not selected and self._discrete_state == before:
            return boot
        snapshot = self._source.snapshot(CAN_PEER, now_s)
        return boot + ([self._force(snapshot)] if selected else []) + self._changes(snapshot, now_s)

    def tick(self, now_s: float) -> list[CanFrame]:
        """Return the frames that are due at this time. Call this method every 10 ms, even without samples."""
        snapshot = self._source.snapshot(CAN_PEER, now_s)
        frames = self._heartbeat(now_s)
        if self._identity_timer.due(now_s):
            frames.append(self._frame(IDENTITY, snapshot))
        if "stale" in snapshot.status:
            frames += self._stale_force(snapshot, now_s)
        frames += self._changes(snapshot, now_s)
        result = self._command_handler.finished_result(snapshot)
        return frames + ([self._answer(result, snapshot)] if result else [])

    def _force(self, snapshot: Any) -> CanFrame:
        self._counter = (self._counter + 1) & 0xFF
        return self._frame(FORCE, snapshot, counter=self._counter)

    def _stale_force(self, snapshot: Any, now_s: float) -> list[CanFrame]:
        """Return a Force frame with the force "not available" if it is due, otherwise no frame.

        The frame is due at once when the samples stop, and then at 10 Hz. When the samples return, the force
        of the first sample is sent at once.
        """
        self._decimator.restart()
        return [self._force(snapshot)] if self._stale_force_timer.due(now_s) else []

    def _changes(self, snapshot: Any, now_s: float) -> list[CanFrame]:
        frames = self._emergency(snapshot)
        if self._status_timer.due(now_s, (snapshot.status, snapshot.state, snapshot.reject_reason)):
            frames.append(self._frame(STATUS_FRAME, snapshot))
        # The wire code of the setpoint is compared, because the setpoint can be NaN and NaN differs from NaN.
        setpoint = STATE.fields[0].encode(snapshot.setpoint_kpa)
        if self._state_timer.due(now_s, (setpoint, snapshot.peak_counter)):
            frames.append(self._frame(STATE, snapshot))
        return frames

    def _emergency(self, snapshot: Any) -> list[CanFrame]:
        """Return an Emergency frame "no error" if any fault is gone, and one frame for each new fault."""
        before, self._faults = self._faults, snapshot.faults
        if self._faults == before:
            return []
        codes = [RIG_ERROR + fault for fault in self._faults if fault not in before]
        if not set(before) <= set(self._faults):
            codes.insert(0, NO_ERROR)
        register = GENERIC_ERROR if self._faults else 0
        return [self._frame(EMERGENCY, snapshot, error_code=c, error_register=register) for c in codes]

    def _heartbeat(self, now_s: float) -> list[CanFrame]:
        if not self._heartbeat_timer.due(now_s):
            return []
        state = "operational" if self._booted else "boot_up"
        self._booted = True
        return [self._frame(HEARTBEAT, None, node_state=state)]

    def _frame(self, frame: FrameDefinition, snapshot: Any, **node_values: Any) -> CanFrame:
        return CanFrame(frame.base_id + self.options.node_id, encode(frame, snapshot, **node_values))

    # ---- receiving

    def accepts(self, frame: CanFrame) -> bool:
        """Return True if `receive` must be called for a frame. Other traffic on the bus can be skipped."""
        return frame.id == self._command_id or frame.id in self.transmit_ids

    def is_vent(self, frame: CanFrame) -> bool:
        """Return True if a frame is a Command with mode vent."""
        return frame.id == self._command_id and not frame.kind and is_vent_command(frame.data)

    def receive(self, frame: CanFrame, now_s: float) -> list[CanFrame]:
        """Handle a received frame and return the frames that answer it.

        The node acts only on a Command in a data frame with an 11-bit identifier.
        """
        if not self.accepts(frame):
            return []
        if frame.kind or frame.id != self._command_id:
            self.counters.ignored += 1
            return []
        self.counters.commands += 1
        result = self._command_handler.handle(frame.data, now_s)
        return [self._answer(result, self._source.snapshot(CAN_PEER, now_s))] if result else []

    def _answer(self, result: CommandResult, snapshot: Any) -> CanFrame:
        return self._frame(ANSWER, snapshot, sequence=result.sequence, result=result.result)
