"""Leak monitor: detects a slow leak of the locked balloon before the board trips.

The leak is the rate at which the pressure falls without contact.
"""

from __future__ import annotations

from dataclasses import dataclass, field

#: Time after a new setpoint in which the latex creeps and the gas cools. This time is not evaluated.
CREEP_S = 60.0
#: One minute without contact is evaluated, in segments of 10 s. A top-up or a contact discards only its own
#: segment.
SEGMENT_S, SEGMENTS = 10.0, 6
#: Leak that three top-ups of 0.14 kPa in ten minutes compensate. The board trips at a larger leak.
LEAK_LIMIT_KPA_PER_S = 0.0007


@dataclass(slots=True)
class LeakMonitor:
    """Monitor of the baseline at each setpoint.

    A detected leak stays detected after a vent, until one complete minute at a later setpoint shows no leak.
    """

    detected: bool = False  #: True if the baseline fell faster than top-ups can compensate
    _setpoint_pa: int = 0
    _free_s: float = 0.0
    _segment_s: float = 0.0
    _segment_start_kpa: float = 0.0
    _falls_kpa: list[float] = field(default_factory=list)  # falls in the latest segments, the oldest first

    def step(self, setpoint_pa: int, free: bool, baseline_kpa: float, dt_s: float) -> None:
        """Process one sample. `free` is True if the balloon is locked and without contact."""
        if setpoint_pa != self._setpoint_pa:
            self._restart(setpoint_pa)
        if not free:
            self._segment_s = 0.0
            return
        if self._segment_s == 0:
            self._segment_start_kpa = baseline_kpa
        self._free_s += dt_s
        self._segment_s += dt_s
        if self._segment_s >= SEGMENT_S:
            self._segment_s = 0.0
            self._end_segment(self._segment_start_kpa - baseline_kpa)

    def _end_segment(self, fall_kpa: float) -> None:
        if self._free_s > CREEP_S:
            self._falls_kpa = [*self._falls_kpa, fall_kpa][-SEGMENTS:]
        if len(self._falls_kpa) == SEGMENTS:
            self.detected = sum(self._falls_kpa) > LEAK_LIMIT_KPA_PER_S * SEGMENT_S * SEGMENTS

    def forget(self) -> None:
        """Forget a detected leak, because the balloon was replaced."""
        self.detected = False

    def _restart(self, setpoint_pa: int) -> None:
        self._setpoint_pa = setpoint_pa
        self._free_s = self._segment_s = 0.0
        self._falls_kpa.clear()
