"""Occasions: what gives each TPDO something to tell, as in raw mode."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any

from registers.can.frames import FORCE, STATE, STATUS_FRAME
from registers.can.node import SILENCE_PERIOD_S, Cycle
from registers.can.options import RIG_RATE_HZ


class Occasions:
    """Names of the frames that have an event, from one look to the next."""

    def __init__(self, force_rate_hz: int) -> None:
        self._force_rate_hz = force_rate_hz
        self._credit = self._full
        self._silence = Cycle(SILENCE_PERIOD_S)
        self._alarm = False
        self._seen: dict[str, Hashable] = {}

    @property
    def _full(self) -> int:
        return RIG_RATE_HZ - self._force_rate_hz  # the next sample is sent

    def at_sample(self, snapshot: Any) -> set[str]:
        """At a new sample: Force at its rate, or at once when the force alarm comes."""
        alarm = "force_limit" in snapshot.status
        rose, self._alarm = alarm and not self._alarm, alarm
        self._credit += self._force_rate_hz
        on_turn = self._credit >= RIG_RATE_HZ
        self._credit -= RIG_RATE_HZ if on_turn else 0
        return self._changed(snapshot) | ({FORCE.name} if on_turn or rose else set())

    def at_tick(self, snapshot: Any, now_s: float) -> set[str]:
        """By time alone: Force at once when samples stop, then at 10 Hz."""
        events = self._changed(snapshot)
        if "stale" in snapshot.status:
            self._credit = self._full
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
