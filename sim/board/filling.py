"""Inflating and settling: control of the valves until the balloon reaches the setpoint."""

from __future__ import annotations

from dataclasses import dataclass

from pneuforce.protocol.limits import FILL_KPA_PER_S
from pneuforce.sim.board.reading import PressureReading
from pneuforce.sim.board.states import FILL, LOCKED, SAFE, Trigger

#: Expected time constant of the tube and switching time of a valve.
TUBE_LAG_S = 0.06
VALVE_DELAY_S = 0.012
VENT_KPA_PER_S = 8.0
#: Time after which the pressures of balloon and sensor are equal.
EQUALISE_S = 0.3
#: Half of the specified ±0.1 kPa. The other half is left for creep and leakage.
BAND_KPA = 0.05
IN_BAND_S = 0.3
FAR_KPA = 0.5
#: Part of the error that one pulse corrects. Less than 1, so that a faster circuit than expected converges
#: too.
PULSE_FRACTION = 0.7
MAX_PULSE_S = 0.5


@dataclass(slots=True)
class FillController:
    """Controller of the valves from one setpoint to the next."""

    valves: int = LOCKED  #: `Valve` mask
    elapsed_s: float = 0.0  #: time since the start
    valve_actions: int = 0  #: valve actions since the start
    lowest_kpa: float = 0.0  #: lowest pressure since the start
    _since_action_s: float = 0.0  # time since the last valve action
    _in_band_s: float = 0.0
    _pulse_left_s: float = 0.0  # remaining time of the pulse in progress

    def start(self, reading: PressureReading) -> None:
        """Start to a new setpoint from the present pressure."""
        self.elapsed_s = self._in_band_s = 0.0
        self.valve_actions = 0
        self.lowest_kpa = self._predicted_kpa(reading)

    def lock(self) -> None:
        """Close both valves immediately."""
        self._drive(LOCKED)
        self._pulse_left_s = 0.0

    def step(self, reading: PressureReading, dt_s: float) -> None:
        """Update times and the lowest pressure by one sample."""
        self.elapsed_s += dt_s
        self._since_action_s += dt_s
        self._pulse_left_s -= dt_s
        self.lowest_kpa = min(self.lowest_kpa, reading.filtered_kpa)

    def inflate(self, reading: PressureReading, setpoint_kpa: float) -> Trigger | None:
        """Keep the inlet open until the pressure that is still in the tube reaches the setpoint."""
        if self._predicted_kpa(reading) < setpoint_kpa - BAND_KPA:
            self._drive(FILL)
            return None
        self.lock()
        return Trigger.NEAR_SETPOINT

    def _predicted_kpa(self, reading: PressureReading) -> float:
        """Return the final pressure at the sensor if both valves were closed now."""
        return reading.filtered_kpa + reading.rate_kpa_per_s * (TUBE_LAG_S + VALVE_DELAY_S)

    def settle(self, reading: PressureReading, setpoint_kpa: float, dt_s: float) -> Trigger | None:
        """Wait for equal pressures, then pulse towards the setpoint until the pressure stays in the band."""
        if self._pulse_left_s > 0:
            return None
        self._drive(LOCKED)
        if self._since_action_s < EQUALISE_S:
            return None
        error_kpa = setpoint_kpa - reading.filtered_kpa
        if -BAND_KPA <= error_kpa <= BAND_KPA:
            self._in_band_s += dt_s
            return Trigger.SETTLED if self._in_band_s >= IN_BAND_S else None
        self._in_band_s = 0.0
        if error_kpa > FAR_KPA:
            return Trigger.FAR_BELOW_SETPOINT
        self._start_pulse(error_kpa)
        return None

    def _start_pulse(self, error_kpa: float) -> None:
        rate = FILL_KPA_PER_S if error_kpa > 0 else -VENT_KPA_PER_S
        self._pulse_left_s = min(PULSE_FRACTION * error_kpa / rate, MAX_PULSE_S)
        self._drive(FILL if error_kpa > 0 else SAFE)

    def _drive(self, valves: int) -> None:
        if valves != self.valves:
            self.valves = valves
            self.valve_actions += 1
            self._since_action_s = 0.0
