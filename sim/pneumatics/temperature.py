"""Temperature of the gas: slow change towards a target, and heat of compression."""

from __future__ import annotations

import math
from dataclasses import dataclass

#: Temperature to which amounts of gas are converted, 20 °C [K].
REFERENCE_TEMPERATURE_K = 293.15


@dataclass(slots=True)
class GasTemperature:
    """Temperature of a part of the gas, which approaches the temperature of its surroundings."""

    time_s: float
    target_k: float = 0.0  #: temperature of the surroundings, minus 20 °C
    now_k: float = 0.0  #: temperature of the gas, minus 20 °C

    @property
    def ratio(self) -> float:
        """Return the absolute temperature as a multiple of the reference temperature."""
        return 1 + self.now_k / REFERENCE_TEMPERATURE_K

    def step(self, dt_s: float) -> None:
        """Advance the time by `dt_s`."""
        if self.now_k != self.target_k:
            self.now_k += (self.target_k - self.now_k) * -math.expm1(-dt_s / self.time_s)


@dataclass(slots=True)
class CompressionHeat:
    """Heating of the gas by a fast polytropic change. The walls absorb the heat."""

    polytropic: float
    relaxation_s: float
    heat: float = 0.0  #: natural logarithm of `ratio`
    _before_kpa: float | None = None

    @property
    def ratio(self) -> float:
        """Return the absolute temperature of the gas as a multiple of the temperature of the walls."""
        return math.exp(self.heat)

    def step(self, absolute_kpa: float, dt_s: float) -> None:
        """Apply the heating T ~ p^((n−1)/n) by a change to `absolute_kpa`, and the decay during `dt_s`."""
        if self.polytropic == 1 and not self.heat:
            return
        before_kpa = self._before_kpa or absolute_kpa
        exponent = (self.polytropic - 1) / self.polytropic
        self.heat *= math.exp(-dt_s / self.relaxation_s)
        self.heat += exponent * math.log(absolute_kpa / before_kpa)
        self._before_kpa = absolute_kpa
