"""The zero of the pressure sensor: what it reads at no pressure."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from instrument.rig.limits import ZERO_SPAN_KPA
from instrument.rig.link import BRIDGED_S

STEADY_KPA = 0.05
STEADY_S = 0.5


@dataclass(slots=True)
class Zero:
    """What the sensor reads at no pressure, taken only from a vented and steady rig; undoable."""

    zero_kpa: float = math.nan
    previous_kpa: float = math.nan
    _low_kpa: float = field(default=math.inf)
    _high_kpa: float = field(default=-math.inf)
    _latest_kpa: float = math.nan
    _steady_s: float = 0.0

    @property
    def taken(self) -> bool:
        """Whether there is a zero."""
        return math.isfinite(self.zero_kpa)

    def observe(self, nominal_kpa: float, vented: bool, dt_s: float) -> None:
        """Follow the filtered reading; it is steady when it stays within 0.05 kPa for 0.5 s while vented."""
        self._latest_kpa = nominal_kpa
        low, high = min(self._low_kpa, nominal_kpa), max(self._high_kpa, nominal_kpa)
        if vented and high - low <= STEADY_KPA:
            self._low_kpa, self._high_kpa = low, high
            self._steady_s += min(dt_s, BRIDGED_S)
        else:
            self._low_kpa = self._high_kpa = nominal_kpa
            self._steady_s = 0.0

    @property
    def possible(self) -> bool:
        """Whether a zero may be taken now."""
        return self._steady_s >= STEADY_S and -ZERO_SPAN_KPA <= self._latest_kpa <= ZERO_SPAN_KPA

    def take(self) -> bool:
        """Take the zero from the steady reading; False where that is not possible now."""
        if not self.possible:
            return False
        self.previous_kpa, self.zero_kpa = self.zero_kpa, self._latest_kpa
        return True

    def forget(self) -> None:
        """There is another sensor now: no zero, and none to go back to."""
        self.zero_kpa = self.previous_kpa = math.nan

    def undo(self) -> bool:
        """Go back to the zero before this one; False where there was none."""
        if not math.isfinite(self.previous_kpa):
            return False
        self.zero_kpa, self.previous_kpa = self.previous_kpa, self.zero_kpa
        return True
