"""Contact tracking: when a contact begins and ends, and the pressure ΔP_i before it.

ΔP_i is the lowest pressure before the rise, measured anew for each contact (paper, Section IV-B). While
the balloon is free a floor follows the pressure down at once and up slowly; it is the baseline.

A contact ends when the pressure is back at its floor. Where the next contact comes before that, it is
told from a mere easing of the hand by how far the pressure fell: once the rise has dropped below
`RELEASED` of its peak, the next upturn is a new contact, and the trough is its ΔP_i.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

ONSET_KPA = 0.06
END_KPA = 0.03
RELEASED = 0.3
#: The floor follows a slowly rising pressure with this time constant: slower than ONSET_KPA / FLOOR_S
#: (0.03 kPa/s) is drift, faster is contact.
FLOOR_S = 2.0
DRIFT_S = 5.0


@dataclass(slots=True)
class ContactTracker:
    """Follows the filtered pressure of the locked balloon."""

    in_contact: bool = False
    initial_kpa: float = math.nan  #: ΔP_i of the contact in progress, else the baseline
    count: int = 0  #: contacts begun
    finished: int = 0  #: contacts ended
    drift_kpa_per_s: float = math.nan
    baseline_age_s: float = math.inf  #: where there was none yet
    _peak_kpa: float = math.nan
    _trough_kpa: float = math.nan
    _slow_kpa: float = math.nan

    def step(self, pressure_kpa: float, locked: bool, dt_s: float) -> None:
        """One sample later. Leaving the locked state ends the contact and forgets the baseline."""
        if not locked or not math.isfinite(pressure_kpa):
            self._unlocked(dt_s)
        elif self.in_contact:
            self._pressed(pressure_kpa, dt_s)
        else:
            self._free(pressure_kpa, dt_s)

    def _unlocked(self, dt_s: float) -> None:
        if self.in_contact:
            self._end()
        self.initial_kpa = self.drift_kpa_per_s = self._slow_kpa = math.nan
        self.baseline_age_s += dt_s

    def _free(self, pressure_kpa: float, dt_s: float) -> None:
        if not math.isfinite(self.initial_kpa):
            self.initial_kpa = self._slow_kpa = pressure_kpa
        above = pressure_kpa - self.initial_kpa
        if above > ONSET_KPA:
            self._begin(self.initial_kpa, pressure_kpa)
            return
        self.initial_kpa += above if above < 0 else above * dt_s / FLOOR_S
        self._slow_kpa += (pressure_kpa - self._slow_kpa) * dt_s / DRIFT_S
        self.drift_kpa_per_s = (pressure_kpa - self._slow_kpa) / DRIFT_S
        self.baseline_age_s = 0.0

    def _begin(self, initial_kpa: float, pressure_kpa: float) -> None:
        self.in_contact = True
        self.count += 1
        self.initial_kpa = initial_kpa
        self._peak_kpa = self._trough_kpa = pressure_kpa

    def _pressed(self, pressure_kpa: float, dt_s: float) -> None:
        self.baseline_age_s += dt_s
        rise = pressure_kpa - self.initial_kpa
        if rise < END_KPA:
            self._end()
            self.initial_kpa = self._slow_kpa = pressure_kpa
            return
        if pressure_kpa > self._peak_kpa:
            self._peak_kpa = self._trough_kpa = pressure_kpa
        self._trough_kpa = min(self._trough_kpa, pressure_kpa)
        released = self._trough_kpa - self.initial_kpa < RELEASED * (self._peak_kpa - self.initial_kpa)
        if released and pressure_kpa > self._trough_kpa + ONSET_KPA:
            self._end()
            self._begin(self._trough_kpa, pressure_kpa)

    def _end(self) -> None:
        self.in_contact = False
        self.finished += 1
