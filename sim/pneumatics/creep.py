"""Creep: latex that is held at a pressure goes on growing."""

from __future__ import annotations

import math
from dataclasses import dataclass

REFERENCE_KPA = 8.0


@dataclass(slots=True)
class Creep:
    """A volume that grows by a share of itself, in proportion to the pressure, with one time constant."""

    amplitude: float  #: the share in the end, at 8 kPa
    time_s: float
    growth: float = 0.0  #: the share now

    def step(self, pressure_kpa: float, dt_s: float) -> None:
        """Hold a pressure above that around the balloon for `dt_s`."""
        if self.amplitude or self.growth:
            target = self.amplitude * pressure_kpa / REFERENCE_KPA if pressure_kpa > 0 else 0.0
            self.growth += (target - self.growth) * -math.expm1(-dt_s / self.time_s)
