"""Events that trigger the TPDOs. A frame in raw mode is triggered by the same events."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any

from pneuforce.registers.can.force_decimator import ForceDecimator
from pneuforce.registers.can.frames import FORCE, STATE, STATUS_FRAME
from pneuforce.registers.can.node import STALE_FORCE_PERIOD_S, TransmitTimer


class PdoTriggers:
    """Detector for the events that trigger the TPDOs. An event is returned as the name of its frame."""

    def __init__(self, force_rate_hz: int) -> None:
        self._decimator = ForceDecimator(force_rate_hz)
        self._stale_force_timer = TransmitTimer(STALE_FORCE_PERIOD_S)
        self._last_content: dict[str, Hashable] = {}

    def force_due(self, *, alarm: bool) -> bool:
        """Return True if Force must be triggered at this sample, by its rate or by an alarm. Call it once."""
        return self._decimator.selects(alarm=alarm)

    def at_sample(self, snapshot: Any, *, force_due: bool) -> set[str]:
        """Return the events at a new sample: changed frames, and Force if it is due."""
        return self._changed(snapshot) | ({FORCE.name} if force_due else set())

    def at_tick(self, snapshot: Any, now_s: float) -> set[str]:
        """Return the events that need no new sample: changed frames, and Force if the samples have stopped.

        Force is triggered at once when the samples stop, and then at 10 Hz. The first new sample triggers
        Force at once.
        """
        events = self._changed(snapshot)
        if "stale" in snapshot.status:
            self._decimator.restart()
            events |= {FORCE.name} if self._stale_force_timer.due(now_s) else set()
        return events

    def _changed(self, snapshot: Any) -> set[str]:
        # The wire code of the setpoint is compared, because the setpoint can be NaN and NaN differs from NaN.
        setpoint = STATE.fields[0].encode(snapshot.setpoint_kpa)
        content: dict[str, Hashable] = {
            STATE.name: (setpoint, snapshot.peak_counter),
            STATUS_FRAME.name: (snapshot.status, snapshot.state, snapshot.reject_reason),
        }
        last = self._last_content
        changed = {name for name, value in content.items() if value != last.get(name, value)}
        self._last_content = content
        return changed
