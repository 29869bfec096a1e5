"""Zero adjustment of the pressure sensor (VIM 4.12)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from pneuforce.instrument.rig.link import MAX_SAMPLE_SPAN_S
from pneuforce.protocol.limits import ZERO_SPAN_KPA

#: The reading of the vented rig is steady if it stays within a span of `STEADY_KPA` for `STEADY_S`.
STEADY_KPA = 0.05
STEADY_S = 0.5


@dataclass(slots=True)
class ZeroAdjustment:
    """Zero of the pressure sensor: its reading at no pressure, taken only from a vented and steady rig.

    The previous zero is kept and can be restored.
    """

    zero_kpa: float = math.nan
    previous_kpa: float = math.nan
    _low_kpa: float = field(default=math.inf)
    _high_kpa: float = field(default=-math.inf)
    _latest_kpa: float = math.nan
    _steady_s: float = 0.0

    @property
    def taken(self) -> bool:
        """Return True if a zero was taken."""
        return math.isfinite(self.zero_kpa)

    def observe(self, nominal_kpa: float, vented: bool, dt_s: float) -> None:
        """Process one filtered reading, to detect when the vented rig is steady.

        `dt_s` is the time since the last reading.
        """
        self._latest_kpa = nominal_kpa
        low, high = min(self._low_kpa, nominal_kpa), max(self._high_kpa, nominal_kpa)
        if vented and high - low <= STEADY_KPA:
            self._low_kpa, self._high_kpa = low, high
            self._steady_s += min(dt_s, MAX_SAMPLE_SPAN_S)
        else:
            self._low_kpa = self._high_kpa = nominal_kpa
            self._steady_s = 0.0

    @property
    def can_take(self) -> bool:
        """Return True if the reading is steady and within the permitted span of the zero."""
        return self._steady_s >= STEADY_S and -ZERO_SPAN_KPA <= self._latest_kpa <= ZERO_SPAN_KPA

    def take(self) -> bool:
        """Take the zero from the steady reading. Return False if `can_take` is False."""
        if not self.can_take:
            return False
        self.previous_kpa, self.zero_kpa = self.zero_kpa, self._latest_kpa
        return True

    def clear(self) -> None:
        """Discard the zero and the previous zero, because the sensor was replaced."""
        self.zero_kpa = self.previous_kpa = math.nan

    def restore_previous(self) -> bool:
        """Exchange the zero and the previous zero. Return False if there is no previous zero."""
        if not math.isfinite(self.previous_kpa):
            return False
        self.zero_kpa, self.previous_kpa = self.previous_kpa, self.zero_kpa
        return True
