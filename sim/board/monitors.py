"""Monitors of the open inlet, the open vent, the emptying balloon and the number of top-ups."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field

from pneuforce.protocol.limits import (
    HALVING_FROM_KPA,
    HALVING_TIME_S,
    SETPOINT_PA,
    VENTED_KPA,
    VENTED_S,
    ZERO_SPAN_KPA,
)
from pneuforce.sim.board.filling import TUBE_LAG_S, VALVE_DELAY_S
from pneuforce.sim.board.reading import PressureReading

#: Highest pressure of a vented balloon while the zero of the sensor is unknown [kPa].
VENTED_NOMINAL_KPA = ZERO_SPAN_KPA + VENTED_KPA
STEADY_KPA = 0.05
#: Smallest fall of the pressure that shows that the vent is open [kPa].
MIN_FALL_KPA = 0.2
MIN_RISE_KPA = 0.2
RISE_WINDOW_S = 0.3
#: Time after the opening of the inlet until the lag of the tube has no effect [s]. Rise rate and highest
#: pressure are not evaluated before that time.
LAG_OVER_S = 0.1
#: Lowest starting pressure of the first and of each later halving [kPa]. Below the lowest setpoint, the time
#: of the first halving does not show how much gas was in the circuit.
FIRST_HALVING_FROM_KPA, LATER_HALVING_FROM_KPA = SETPOINT_PA[0] * 0.9e-3, 2 * VENTED_KPA
HALVINGS = 3
#: Halvings are equal if their smallest ratio, divided by their largest, is at least this value. If only the
#: tubes empty, the quotient is above 0.94.
EQUAL_RATIO = 0.8
TOP_UP_BELOW_KPA = 0.1
TOP_UP_AFTER_S = 2.0
TOP_UP_WINDOW_S = 600.0
TOP_UP_HISTORY = 8


@dataclass(slots=True)
class InletValveMonitor:
    """Monitor of the pressure while the inlet is open."""

    stalled: bool = False  #: the pressure rose by less than 0.2 kPa in 300 ms
    fallen_kpa: float = 0.0  #: fall from the highest pressure since the inlet was opened
    rise_kpa_per_s: float = 0.0  #: mean rate of rise over 0.1 to 0.3 s
    _open_s: float = 0.0
    _window_s: float = 0.0
    _window_start_kpa: float = 0.0
    _highest_kpa: float = -math.inf

    def step(self, inlet_open: bool, reading: PressureReading, dt_s: float) -> None:
        """Add one sample."""
        if not inlet_open:
            self._restart()
            return
        if self._open_s == 0:
            self._window_start_kpa = reading.filtered_kpa
        self._open_s += dt_s
        self._window_s += dt_s
        if self._window_s >= LAG_OVER_S:
            self.rise_kpa_per_s = (reading.filtered_kpa - self._window_start_kpa) / self._window_s
        if self._window_s >= RISE_WINDOW_S:
            self.stalled = not reading.filtered_kpa - self._window_start_kpa >= MIN_RISE_KPA
            self._window_start_kpa, self._window_s = reading.filtered_kpa, 0.0
        if self._open_s >= LAG_OVER_S:
            self._highest_kpa = max(self._highest_kpa, reading.filtered_kpa)
            self.fallen_kpa = self._highest_kpa - reading.filtered_kpa

    def _restart(self) -> None:
        self.stalled = False
        self.fallen_kpa = self.rise_kpa_per_s = self._open_s = self._window_s = 0.0
        self._highest_kpa = -math.inf


@dataclass(slots=True)
class VentValveMonitor:
    """Monitor of the pressure while the vent is open: detects an empty balloon, or a vent that stays shut."""

    verified: bool = False  #: the measured pressure shows that the balloon is empty
    no_fall_s: float = 0.0  #: time since the last fall by 0.2 kPa; 0 if the balloon is empty
    _low_kpa: float = math.inf
    _high_kpa: float = -math.inf
    _steady_s: float = 0.0
    _reference_kpa: float = math.inf

    def step(self, vent_open: bool, reading: PressureReading, dt_s: float) -> None:
        """Add one sample. An invalid sensor or a closed vent restarts the monitor."""
        if not (vent_open and reading.sensor_ok):
            self._restart()
            return
        self._update_steady_time(reading, dt_s)
        self.verified = self._steady_s >= VENTED_S
        if self.verified or reading.filtered_kpa <= self._reference_kpa - MIN_FALL_KPA:
            self._reference_kpa, self.no_fall_s = reading.filtered_kpa, 0.0
        else:
            self.no_fall_s += dt_s

    def _update_steady_time(self, reading: PressureReading, dt_s: float) -> None:
        """Count the time at low pressure. While the zero is unknown, the pressure must also be steady."""
        now = reading.filtered_kpa
        low, high = min(self._low_kpa, now), max(self._high_kpa, now)
        if now <= vented_kpa(reading) and (reading.zeroed or high - low <= STEADY_KPA):
            self._low_kpa, self._high_kpa = low, high
            self._steady_s += dt_s
        else:
            self._low_kpa = self._high_kpa = now
            self._steady_s = 0.0

    def _restart(self) -> None:
        self.verified = False
        self.no_fall_s = self._steady_s = 0.0
        self._low_kpa = self._reference_kpa = math.inf
        self._high_kpa = -math.inf


@dataclass(slots=True)
class EmptyingMonitor:
    """Monitor of the speed at which the vent empties the balloon.

    The time in which the pressure halves is divided by the time of the commissioned circuit. If only the
    tubes empty, this ratio is too small, and it is equal for each halving. If a contact ends during the vent,
    the pressure falls faster, too, but not equally. Therefore, a vent that starts during a contact is judged
    by three halvings, and every other vent by the first. If the vent valve was already open, as after a trip,
    the vent is not judged.
    """

    halving_time_ratio: float = math.inf  #: judged halving time / commissioned halving time
    _venting: bool = False
    _was_shut: bool = False  # the vent valve was shut before the vent
    _pressed: bool = False  # at the start of the vent
    _elapsed_s: float = 0.0  # since the start of the present halving
    _from_kpa: float = 0.0  # pressure at that time
    _ratios: list[float] = field(default_factory=list)

    def step(
        self, venting: bool, vent_open: bool, pressed: bool, reading: PressureReading, dt_s: float
    ) -> None:
        """Add one sample."""
        if not venting:
            self.halving_time_ratio, self._venting, self._was_shut = math.inf, False, not vent_open
            return
        if not self._venting:
            self._venting, self._pressed, self._ratios = True, pressed, []
            self._elapsed_s, self._from_kpa = 0.0, reading.filtered_kpa
        self._elapsed_s += dt_s
        from_kpa = LATER_HALVING_FROM_KPA if self._ratios else FIRST_HALVING_FROM_KPA
        halved = self._from_kpa >= from_kpa and reading.filtered_kpa <= 0.5 * self._from_kpa
        if halved and self._was_shut and len(self._ratios) < HALVINGS:
            self._end_halving(reading)

    def _end_halving(self, reading: PressureReading) -> None:
        delay_s = 0.0 if self._ratios else TUBE_LAG_S + VALVE_DELAY_S
        commissioned_s = HALVING_TIME_S * math.sqrt(self._from_kpa / HALVING_FROM_KPA)
        self._ratios.append((self._elapsed_s - delay_s) / commissioned_s)
        self._elapsed_s, self._from_kpa = 0.0, reading.filtered_kpa
        if not self._pressed:
            self.halving_time_ratio = self._ratios[0]
        elif len(self._ratios) == HALVINGS and min(self._ratios) >= EQUAL_RATIO * max(self._ratios):
            self.halving_time_ratio = max(self._ratios)


def vented_kpa(reading: PressureReading) -> float:
    """Return the pressure below which the balloon counts as empty [kPa]."""
    return VENTED_KPA if reading.zeroed else VENTED_NOMINAL_KPA


@dataclass(slots=True)
class TopUpMonitor:
    """Monitor of the held pressure: detects when a top-up is due, and counts the top-ups."""

    low_s: float = 0.0  #: time for which the pressure has been more than 0.1 kPa below the setpoint
    now_s: float = 0.0
    _top_ups_s: deque[float] = field(default_factory=deque)  # times of the last top-ups

    def step(self, observed: bool, reading: PressureReading, setpoint_kpa: float, dt_s: float) -> None:
        """Add one sample.

        The pressure is evaluated only if `observed` is True: the balloon is held without contact, the host is
        active, and the sensor is valid.
        """
        self.now_s += dt_s
        if observed:
            low = reading.filtered_kpa < setpoint_kpa - TOP_UP_BELOW_KPA
            self.low_s = self.low_s + dt_s if low else 0.0

    @property
    def due(self) -> bool:
        """Return True if the balloon needs a top-up."""
        return self.low_s >= TOP_UP_AFTER_S

    @property
    def recent_count(self) -> int:
        """Return the number of top-ups within the last 10 minutes."""
        return sum(self.now_s - t_s <= TOP_UP_WINDOW_S for t_s in self._top_ups_s)

    def restart(self) -> None:
        """Delete the record of top-ups, because the balloon or a joint may have been repaired."""
        self._top_ups_s.clear()
        self.low_s = 0.0

    def record(self) -> None:
        """Record a top-up at the present time."""
        self._top_ups_s = deque((*self._top_ups_s, self.now_s), maxlen=TOP_UP_HISTORY)
        self.low_s = 0.0
