"""Ambient pressure with a linear drift and a periodic swing."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(slots=True)
class Ambient:
    """Absolute pressure of the room.

    Drift and swing are added as rates, so that a change of their parameters causes no step of the pressure.
    """

    kpa: float
    drift_kpa_per_s: float
    swing_kpa: float
    swing_s: float
    _t_s: float = 0.0

    def step(self, dt_s: float) -> None:
        """Advance the time by `dt_s`."""
        self._t_s += dt_s
        if self.drift_kpa_per_s or self.swing_kpa:
            radians_per_s = 2 * math.pi / self.swing_s
            swing_kpa_per_s = self.swing_kpa * radians_per_s * math.cos(radians_per_s * self._t_s)
            self.kpa += (self.drift_kpa_per_s + swing_kpa_per_s) * dt_s
