"""Creep: slow growth of latex at a constant pressure."""

from __future__ import annotations

import math
from dataclasses import dataclass

REFERENCE_KPA = 8.0


@dataclass(slots=True)
class Creep:
    """Relative growth of the volume, proportional to the pressure, with one time constant."""

    amplitude: float  #: final growth at 8 kPa, as a fraction of the volume
    time_s: float
    growth: float = 0.0  #: present growth, as a fraction of the volume

    def step(self, pressure_kpa: float, dt_s: float) -> None:
        """Advance the time by `dt_s` at a pressure relative to the surroundings of the balloon."""
        if self.amplitude or self.growth:
            target = self.amplitude * pressure_kpa / REFERENCE_KPA if pressure_kpa > 0 else 0.0
            self.growth += (target - self.growth) * -math.expm1(-dt_s / self.time_s)
