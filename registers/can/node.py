"""The CAN node without I/O: which frames are due, and what becomes of those received. Time is an argument."""

from __future__ import annotations

import math
from collections.abc import Hashable
from dataclasses import dataclass
from typing import Any

from registers.can.command import CAN, MALFORMED, CommandDesk, Reply, vents
from registers.can.decimation import Decimation
from registers.can.frames import (
    ANSWER,
    COMMAND,
    EMERGENCY,
    FORCE,
    GENERIC_ERROR,
    HEARTBEAT,
    NO_ERROR,
    RIG_ERROR,
    STATE,
    STATUS_FRAME,
    Frame,
    encode,
    sent_ids,
)
from registers.can.options import Options
from registers.can.wire import CanFrame
from registers.source import Source

SILENCE_PERIOD_S = 0.1
STATUS_INHIBIT_S = 0.01


@dataclass(slots=True)
class Counters:
    """What the node has seen since it was made."""

    commands: int = 0  #: received, well formed or not
    ignored: int = 0  #: frames with one of our identifiers that are none of ours to obey


@dataclass(slots=True)
class Cycle:
    """When a frame is due: after each period and at each change, but not within the inhibit time."""

    period_s: float
    inhibit_s: float = 0.0
    _sent_s: float = -math.inf
    _next_s: float = -math.inf
    _key: Hashable = None

    def due(self, now_s: float, key: Hashable = None) -> bool:
        """Whether to send now; `key` is what a change is seen by."""
        on_time = now_s >= self._next_s
        changed = key != self._key and now_s >= self._sent_s + self.inhibit_s
        if not (on_time or changed):
            return False
        late = not now_s - self._next_s <= self.period_s
        self._next_s = now_s + self.period_s if changed or late else self._next_s + self.period_s
        self._sent_s, self._key = now_s, key
        return True


class CanNode:
    """One source as a node: hands out the frames to send, and takes the frames received."""

    def __init__(self, source: Source, options: Options) -> None:
        self.options = options
        self.counters = Counters()
        self.own_ids = sent_ids(options.node_id)
        self._source = source
        self._desk = CommandDesk(source)
        self._command_id = COMMAND.base_id + options.node_id
        self._counter = 0
        self._decimation = Decimation(options.force_rate_hz)
        self._silence = Cycle(SILENCE_PERIOD_S)
        self._state = Cycle(STATE.period_s)
        self._status = Cycle(STATUS_FRAME.period_s, STATUS_INHIBIT_S)
        self._heartbeat = Cycle(HEARTBEAT.period_s)
        self._booted = False
        self._faults: tuple[int, ...] = ()

    # ---- to the bus

    def on_sample(self, now_s: float) -> list[CanFrame]:
        """Frames due at a new sample: Force at its rate or with an alarm, and what has changed."""
        snapshot = self._source.snapshot(CAN, now_s)
        taken = self._decimation.takes(alarm="force_limit" in snapshot.status)
        return ([self._force(snapshot)] if taken else []) + self._changes(snapshot, now_s)

    def tick(self, now_s: float) -> list[CanFrame]:
        """Frames due by time alone; to be called every 10 ms, with samples or without."""
        snapshot = self._source.snapshot(CAN, now_s)
        frames = self._alive(now_s)
        if "stale" in snapshot.status:
            frames += self._silent(snapshot, now_s)
        frames += self._changes(snapshot, now_s)
        reply = self._desk.ended(snapshot)
        return frames + ([self._answer(reply, snapshot)] if reply else [])

    def _force(self, snapshot: Any) -> CanFrame:
        self._counter = (self._counter + 1) & 0xFF
        return self._frame(FORCE, snapshot, counter=self._counter)

    def _silent(self, snapshot: Any, now_s: float) -> list[CanFrame]:
        """Force not available: at once when samples stop, then at 10 Hz; the next sample is sent at once."""
        self._decimation.restart()
        return [self._force(snapshot)] if self._silence.due(now_s) else []

    def _changes(self, snapshot: Any, now_s: float) -> list[CanFrame]:
        frames = self._emergency(snapshot)
        finished = snapshot.contact_counter - ("in_contact" in snapshot.status)
        if self._status.due(now_s, (snapshot.status, snapshot.state, snapshot.refusal)):
            frames.append(self._frame(STATUS_FRAME, snapshot))
        setpoint = STATE.fields[0].encode(snapshot.setpoint_kpa)  # a code: NaN is not equal to itself
        if self._state.due(now_s, (setpoint, finished)):
            frames.append(self._frame(STATE, snapshot))
        return frames

    def _emergency(self, snapshot: Any) -> list[CanFrame]:
        """One frame for each fault that has come, one for those that have gone."""
        before, self._faults = self._faults, snapshot.faults
        if self._faults == before:
            return []
        codes = [RIG_ERROR + fault for fault in self._faults if fault not in before]
        if not set(before) <= set(self._faults):
            codes.insert(0, NO_ERROR)
        register = GENERIC_ERROR if self._faults else 0
        return [self._frame(EMERGENCY, snapshot, error_code=c, error_register=register) for c in codes]

    def _alive(self, now_s: float) -> list[CanFrame]:
        if not self._heartbeat.due(now_s):
            return []
        state = "operational" if self._booted else "boot_up"
        self._booted = True
        return [self._frame(HEARTBEAT, None, node_state=state)]

    def _frame(self, frame: Frame, snapshot: Any, **own: Any) -> CanFrame:
        return CanFrame(frame.base_id + self.options.node_id, encode(frame, snapshot, **own))

    # ---- from the bus

    def hears(self, frame: CanFrame) -> bool:
        """Whether a frame concerns this node at all; the rest of the bus's traffic does not."""
        return frame.id == self._command_id or frame.id in self.own_ids

    def is_vent(self, frame: CanFrame) -> bool:
        """Whether a frame asks for a vent."""
        return frame.id == self._command_id and not frame.kind and vents(frame.data)

    def receive(self, frame: CanFrame, now_s: float) -> list[CanFrame]:
        """Frames that answer one received: only a Command is obeyed, in a data frame with an 11-bit id."""
        if not self.hears(frame):
            return []
        if frame.kind or frame.id != self._command_id:
            self.counters.ignored += 1
            return []
        self.counters.commands += 1
        reply = self._desk.take(frame.data, now_s)
        if reply and reply.result in MALFORMED:
            self._source.refused(CAN, frame.data, reply.result, now_s)
        return [self._answer(reply, self._source.snapshot(CAN, now_s))] if reply else []

    def _answer(self, reply: Reply, snapshot: Any) -> CanFrame:
        return self._frame(ANSWER, snapshot, sequence=reply.sequence, result=reply.result)
