"""Occasions: what gives each TPDO something to tell, as in raw mode."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any

from registers.can.decimation import Decimation
from registers.can.frames import FORCE, STATE, STATUS_FRAME
from registers.can.node import SILENCE_PERIOD_S, Cycle


class Occasions:
    """Names of the frames that have an event, from one look to the next."""

    def __init__(self, force_rate_hz: int) -> None:
        self._decimation = Decimation(force_rate_hz)
        self._silence = Cycle(SILENCE_PERIOD_S)
        self._seen: dict[str, Hashable] = {}

    def at_sample(self, snapshot: Any) -> set[str]:
        """At a new sample: Force at its rate, or with an alarm."""
        taken = self._decimation.takes(alarm="force_limit" in snapshot.status)
        return self._changed(snapshot) | ({FORCE.name} if taken else set())

    def at_tick(self, snapshot: Any, now_s: float) -> set[str]:
        """By time alone: Force at once when samples stop, then at 10 Hz; the next sample is sent at once."""
        events = self._changed(snapshot)
        if "stale" in snapshot.status:
            self._decimation.restart()
            events |= {FORCE.name} if self._silence.due(now_s) else set()
        return events

    def _changed(self, snapshot: Any) -> set[str]:
        finished = snapshot.contact_counter - ("in_contact" in snapshot.status)
        setpoint = STATE.fields[0].encode(snapshot.setpoint_kpa)  # a code: NaN is not equal to itself
        now: dict[str, Hashable] = {
            STATE.name: (setpoint, finished),
            STATUS_FRAME.name: (snapshot.status, snapshot.state, snapshot.refusal),
        }
        changed = {name for name, key in now.items() if key != self._seen.get(name, key)}
        self._seen = now
        return changed
