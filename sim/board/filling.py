"""Inflating and settling: how the valves bring the balloon to its setpoint."""

from __future__ import annotations

from dataclasses import dataclass

from instrument.rig.limits import FILL_KPA_PER_S
from sim.board.reading import Reading
from sim.board.states import FILL, LOCKED, SAFE, Happening

#: What the board must expect of its circuit: the tube's lag and the time a valve takes.
TUBE_S = 0.06
VALVE_S = 0.012
VENT_KPA_PER_S = 8.0
#: Pressure differences between balloon and sensor have died away after this time.
EQUAL_S = 0.3
#: Half of the promised ±0.1 kPa: creep and leak want the other half.
BAND_KPA = 0.05
WITHIN_S = 0.3
FAR_KPA = 0.5
#: Share of the error that one pulse takes away, so that a faster circuit than expected still converges.
PULSE_SHARE = 0.7
LONGEST_PULSE_S = 0.5


@dataclass(slots=True)
class Filling:
    """One journey to a setpoint."""

    valves: int = LOCKED
    elapsed_s: float = 0.0
    actions: int = 0  #: valve actions since the journey began
    lowest_kpa: float = 0.0  #: lowest pressure since it began
    _still_s: float = 0.0  # since the last valve action
    _within_s: float = 0.0
    _pulse_s: float = 0.0  # left of the pulse in progress

    def begin(self, reading: Reading) -> None:
        """Set out to a new setpoint from where the pressure is now."""
        self.elapsed_s = self._within_s = 0.0
        self.actions = 0
        self.lowest_kpa = self._coming_kpa(reading)

    def lock(self) -> None:
        """Shut both valves at once."""
        self._drive(LOCKED)
        self._pulse_s = 0.0

    def step(self, reading: Reading, dt_s: float) -> None:
        """Time passes, whatever the valves do."""
        self.elapsed_s += dt_s
        self._still_s += dt_s
        self._pulse_s -= dt_s
        self.lowest_kpa = min(self.lowest_kpa, reading.smooth_kpa)

    def inflate(self, reading: Reading, setpoint_kpa: float) -> Happening | None:
        """Keep the inlet open until what is still coming through the tube is enough."""
        if self._coming_kpa(reading) < setpoint_kpa - BAND_KPA:
            self._drive(FILL)
            return None
        self.lock()
        return Happening.NEAR

    def _coming_kpa(self, reading: Reading) -> float:
        """Pressure at the sensor once the tube has equalised, were a valve told to close now."""
        return reading.smooth_kpa + reading.rate_kpa_per_s * (TUBE_S + VALVE_S)

    def settle(self, reading: Reading, setpoint_kpa: float, dt_s: float) -> Happening | None:
        """Wait for equal pressures, then pulse towards the setpoint until it is held for a while."""
        if self._pulse_s > 0:
            return None
        self._drive(LOCKED)
        if self._still_s < EQUAL_S:
            return None
        error_kpa = setpoint_kpa - reading.smooth_kpa
        if -BAND_KPA <= error_kpa <= BAND_KPA:
            self._within_s += dt_s
            return Happening.SETTLED if self._within_s >= WITHIN_S else None
        self._within_s = 0.0
        if error_kpa > FAR_KPA:
            return Happening.FAR
        self._pulse(error_kpa)
        return None

    def _pulse(self, error_kpa: float) -> None:
        rate = FILL_KPA_PER_S if error_kpa > 0 else -VENT_KPA_PER_S
        self._pulse_s = min(PULSE_SHARE * error_kpa / rate, LONGEST_PULSE_S)
        self._drive(FILL if error_kpa > 0 else SAFE)

    def _drive(self, valves: int) -> None:
        if valves != self.valves:
            self.valves = valves
            self.actions += 1
            self._still_s = 0.0
