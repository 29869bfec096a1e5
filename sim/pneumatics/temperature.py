"""Temperatures of the gas: slow warming towards a target, and the heat of compression."""

from __future__ import annotations

import math
from dataclasses import dataclass

#: Temperature at which gas is counted, 20 °C [K].
COUNTED_AT_K = 293.15


@dataclass(slots=True)
class Warmth:
    """A part of the gas that takes on the temperature of its surroundings."""

    time_s: float
    target_k: float = 0.0  #: how much warmer than 20 °C the surroundings are
    now_k: float = 0.0  #: how much warmer the gas is

    @property
    def ratio(self) -> float:
        """Absolute temperature, as a multiple of that at which gas is counted."""
        return 1 + self.now_k / COUNTED_AT_K

    def step(self, dt_s: float) -> None:
        """Warm for `dt_s`."""
        if self.now_k != self.target_k:
            self.now_k += (self.target_k - self.now_k) * -math.expm1(-dt_s / self.time_s)


@dataclass(slots=True)
class Compression:
    """The heat of compression: a polytropic change at once, taken back by the walls."""

    polytropic: float
    relaxation_s: float
    heat: float = 0.0  #: logarithm of the temperature's ratio
    _before_kpa: float | None = None

    @property
    def ratio(self) -> float:
        """Absolute temperature, as a multiple of that of the walls."""
        return math.exp(self.heat)

    def step(self, absolute_kpa: float, dt_s: float) -> None:
        """The pressure has become `absolute_kpa`: T ~ p^((n−1)/n), fading with the relaxation."""
        if self.polytropic == 1 and not self.heat:
            return
        before_kpa = self._before_kpa or absolute_kpa
        share = (self.polytropic - 1) / self.polytropic
        self.heat *= math.exp(-dt_s / self.relaxation_s)
        self.heat += share * math.log(absolute_kpa / before_kpa)
        self._before_kpa = absolute_kpa
