"""Inflating and settling: control of the valves until the balloon reaches the setpoint."""

from __future__ import annotations

from dataclasses import dataclass

from pneuforce.protocol.limits import FILL_KPA_PER_S, VENT_KPA_PER_S
from pneuforce.sim.board.reading import PressureReading
from pneuforce.sim.board.states import FILL, LOCKED, SAFE, Trigger

#: Expected time constant of the tube, and expected switching time of a valve [s].
TUBE_LAG_S = 0.06
VALVE_DELAY_S = 0.012
#: Time after a valve action until the pressures of balloon and sensor are equal [s].
EQUALISE_S = 0.3
#: Largest error of a settled pressure [kPa]: half of the specified error. The other half is reserved for
#: creep and leakage.
BAND_KPA = 0.05
IN_BAND_S = 0.3
FAR_KPA = 0.5
#: Fraction of the error that one pulse corrects. It is less than 1, so that the pressure also converges if it
#: changes faster than expected while a valve is open.
PULSE_FRACTION = 0.7
MAX_PULSE_S = 0.5


@dataclass(slots=True)
class FillController:
    """Controller of the valves while the pressure changes to a new setpoint."""

    valves: int = LOCKED  #: `Valve` mask of the valves to power
    elapsed_s: float = 0.0  #: time since `start`
    valve_actions: int = 0  #: valve actions since `start`
    lowest_kpa: float = 0.0  #: lowest pressure since `start`
    _since_action_s: float = 0.0  # time since the last valve action
    _in_band_s: float = 0.0
    _pulse_left_s: float = 0.0  # remaining time of the pulse in progress

    def start(self, reading: PressureReading) -> None:
        """Start the change from the present pressure to a new setpoint."""
        self.elapsed_s = self._in_band_s = 0.0
        self.valve_actions = 0
        self.lowest_kpa = self._predicted_kpa(reading)

    def lock(self) -> None:
        """Close both valves immediately."""
        self._drive(LOCKED)
        self._pulse_left_s = 0.0

    def step(self, reading: PressureReading, dt_s: float) -> None:
        """Add one sample to the elapsed times and the lowest pressure."""
        self.elapsed_s += dt_s
        self._since_action_s += dt_s
        self._pulse_left_s -= dt_s
        self.lowest_kpa = min(self.lowest_kpa, reading.filtered_kpa)

    def inflate(self, reading: PressureReading, setpoint_kpa: float) -> Trigger | None:
        """Open the inlet until the predicted final pressure reaches the setpoint, then close both valves."""
        if self._predicted_kpa(reading) < setpoint_kpa - BAND_KPA:
            self._drive(FILL)
            return None
        self.lock()
        return Trigger.NEAR_SETPOINT

    def _predicted_kpa(self, reading: PressureReading) -> float:
        """Return the pressure [kPa] that the sensor would finally measure if both valves were closed now."""
        return reading.filtered_kpa + reading.rate_kpa_per_s * (TUBE_LAG_S + VALVE_DELAY_S)

    def settle(self, reading: PressureReading, setpoint_kpa: float, dt_s: float) -> Trigger | None:
        """Wait until balloon and sensor have equal pressures, then correct the pressure by short pulses.

        Return `SETTLED` after the pressure has stayed in the band around the setpoint.
        """
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
