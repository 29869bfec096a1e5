"""The barometer: it drifts and swings."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(slots=True)
class Ambient:
    """Absolute pressure of the room. Drift and swing are rates, so that switching them makes no step."""

    kpa: float
    drift_kpa_per_s: float
    swing_kpa: float
    swing_s: float
    _t_s: float = 0.0

    def step(self, dt_s: float) -> None:
        """Let `dt_s` pass."""
        self._t_s += dt_s
        if self.drift_kpa_per_s or self.swing_kpa:
            turns_per_s = 2 * math.pi / self.swing_s
            swinging = self.swing_kpa * turns_per_s * math.cos(turns_per_s * self._t_s)
            self.kpa += (self.drift_kpa_per_s + swinging) * dt_s
