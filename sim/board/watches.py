"""What must be watched over time: the open inlet, the open vent, and how often the board tops up."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field

from instrument.rig.limits import HALVED_KPA, HALVING_S, SETPOINT_PA, VENTED_KPA, VENTED_S, ZERO_SPAN_KPA
from sim.board.filling import TUBE_S, VALVE_S
from sim.board.reading import Reading

#: Before there is a zero.
VENTED_NOMINAL_KPA = ZERO_SPAN_KPA + VENTED_KPA
STEADY_KPA = 0.05
#: A fall by this much shows that a vent is open.
FALL_KPA = 0.2
RISE_KPA = 0.2
RISE_WITHIN_S = 0.3
#: The tube's lag is over: the highest pressure since counts, and the speed.
LAG_OVER_S = 0.1
#: A fall from less than the lowest setpoint tells nothing about how much gas there was.
HALVED_FROM_KPA = SETPOINT_PA[0] * 0.9e-3
LOW_KPA = 0.1
LOW_S = 2.0
TOP_UPS_WITHIN_S = 600.0
TOP_UPS_KEPT = 8


@dataclass(slots=True)
class InletWatch:
    """The pressure since the inlet was opened."""

    stalled: bool = False  #: no rise of 0.2 kPa in 300 ms
    fallen_kpa: float = 0.0  #: below the highest pressure since
    rise_kpa_per_s: float = 0.0  #: mean of the last 0.1 to 0.4 s
    _open_s: float = 0.0
    _window_s: float = 0.0
    _from_kpa: float = 0.0
    _highest_kpa: float = -math.inf

    def step(self, inlet_open: bool, reading: Reading, dt_s: float) -> None:
        """One sample later."""
        if not inlet_open:
            self._restart()
            return
        if self._open_s == 0:
            self._from_kpa = reading.smooth_kpa
        self._open_s += dt_s
        self._window_s += dt_s
        if self._window_s >= LAG_OVER_S:
            self.rise_kpa_per_s = (reading.smooth_kpa - self._from_kpa) / self._window_s
        if self._window_s >= RISE_WITHIN_S:
            self.stalled = not reading.smooth_kpa - self._from_kpa >= RISE_KPA
            self._from_kpa, self._window_s = reading.smooth_kpa, 0.0
        if self._open_s >= LAG_OVER_S:
            self._highest_kpa = max(self._highest_kpa, reading.smooth_kpa)
            self.fallen_kpa = self._highest_kpa - reading.smooth_kpa

    def _restart(self) -> None:
        self.stalled = False
        self.fallen_kpa = self.rise_kpa_per_s = self._open_s = self._window_s = 0.0
        self._highest_kpa = -math.inf


@dataclass(slots=True)
class VentWatch:
    """The pressure since the vent was opened: whether the rig is empty, or fails to become so."""

    verified: bool = False
    unmoved_s: float = 0.0  #: since the pressure last fell by 0.2 kPa, while the rig is not empty
    _low_kpa: float = math.inf
    _high_kpa: float = -math.inf
    _steady_s: float = 0.0
    _mark_kpa: float = math.inf

    def step(self, vent_open: bool, reading: Reading, dt_s: float) -> None:
        """One sample later. A sensor that is not alive tells nothing."""
        if not (vent_open and reading.alive):
            self._restart()
            return
        self._steady(reading, dt_s)
        self.verified = self._steady_s >= VENTED_S
        if self.verified or reading.smooth_kpa <= self._mark_kpa - FALL_KPA:
            self._mark_kpa, self.unmoved_s = reading.smooth_kpa, 0.0
        else:
            self.unmoved_s += dt_s

    def _steady(self, reading: Reading, dt_s: float) -> None:
        """With a zero, low is enough; without one the pressure must also be steady."""
        now = reading.smooth_kpa
        low, high = min(self._low_kpa, now), max(self._high_kpa, now)
        if now <= vented_kpa(reading) and (reading.zeroed or high - low <= STEADY_KPA):
            self._low_kpa, self._high_kpa = low, high
            self._steady_s += dt_s
        else:
            self._low_kpa = self._high_kpa = now
            self._steady_s = 0.0

    def _restart(self) -> None:
        self.verified = False
        self.unmoved_s = self._steady_s = 0.0
        self._low_kpa = self._mark_kpa = math.inf
        self._high_kpa = -math.inf


@dataclass(slots=True)
class EmptyingWatch:
    """How fast the vent empties the balloon. A pressed one empties faster, and tells nothing."""

    halved_share: float = math.inf  #: time in which the pressure was halved, as share of the commissioned one
    _open_s: float = 0.0
    _from_kpa: float = 0.0

    def step(self, venting: bool, pressed: bool, reading: Reading, dt_s: float) -> None:
        """One sample later."""
        if not venting:
            self.halved_share, self._open_s = math.inf, 0.0
            return
        if self._open_s == 0:
            self._from_kpa = 0.0 if pressed else reading.smooth_kpa
        self._open_s += dt_s
        halved = reading.smooth_kpa <= 0.5 * self._from_kpa
        if halved and self.halved_share == math.inf and self._from_kpa >= HALVED_FROM_KPA:
            commissioned_s = HALVING_S * math.sqrt(self._from_kpa / HALVED_KPA)
            self.halved_share = (self._open_s - TUBE_S - VALVE_S) / commissioned_s


def vented_kpa(reading: Reading) -> float:
    """Pressure below which the rig counts as empty [kPa]."""
    return VENTED_KPA if reading.zeroed else VENTED_NOMINAL_KPA


@dataclass(slots=True)
class TopUps:
    """Whether the held pressure has leaked out of its band, and how often that was mended."""

    low_s: float = 0.0  #: time without contact below the band
    now_s: float = 0.0
    _mended_s: deque[float] = field(default_factory=deque)

    def step(self, free: bool, reading: Reading, setpoint_kpa: float, dt_s: float) -> None:
        """One sample later. `free`: held, heard and without contact; else nothing is learned."""
        self.now_s += dt_s
        if free:
            low = reading.smooth_kpa < setpoint_kpa - LOW_KPA
            self.low_s = self.low_s + dt_s if low else 0.0

    @property
    def due(self) -> bool:
        """Whether the balloon wants gas."""
        return self.low_s >= LOW_S

    @property
    def recent(self) -> int:
        """Top-ups within the last 10 minutes."""
        return sum(self.now_s - t_s <= TOP_UPS_WITHIN_S for t_s in self._mended_s)

    def mend(self) -> None:
        """Note that one is done now."""
        self._mended_s = deque((*self._mended_s, self.now_s), maxlen=TOP_UPS_KEPT)
        self.low_s = 0.0
