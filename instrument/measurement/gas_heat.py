"""Heat that fast changes of the pressure bring into the locked gas, or take out of it, for a short time.

A press compresses the gas and heats it, so that its pressure is too high until the walls have absorbed the
heat. A release cools the gas, and the pressure recovers from below to the pressure before the contact,
because the amount of gas has not changed. The exponent n of the gas is not known. This module therefore
computes the share of a rise that n can change, and the largest dip that the cooling explains.

The temperature follows T ~ p^((n−1)/n) during a fast change of the pressure p, and then returns to that of
the walls with a time constant. In a rigid vessel, the pressure error is therefore (1 − 1/n) times the
pressure after a high-pass filter with this time constant. A balloon gives way, so that its dip is smaller.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from pneuforce.instrument.model.uncertainty import HEAT_EXCHANGE_S

#: 1 − 1/n for the gas exponent n = 1.2, the end of the range of the uncertainty budget. In the circuit of the
#: paper the dip is at most 0.63 of that in a rigid vessel, so that this value also covers n = 1.35.
MAX_COOLING_RATIO = 1 / 6


@dataclass(slots=True)
class GasHeat:
    """Effect of the heat of the gas on its pressure."""

    _pressure_kpa: float = math.nan
    _slow_kpa: float = math.nan  # pressure smoothed over `HEAT_EXCHANGE_S`

    def step(self, pressure_kpa: float, dt_s: float) -> None:
        """Process one sample of the pressure. NaN restarts the calculation with gas as warm as the walls."""
        self._pressure_kpa = pressure_kpa
        if not math.isfinite(self._slow_kpa + pressure_kpa):
            self._slow_kpa = pressure_kpa
            return
        self._slow_kpa += (pressure_kpa - self._slow_kpa) * min(dt_s / HEAT_EXCHANGE_S, 1.0)

    @property
    def dip_kpa(self) -> float:
        """Return how far the pressure can be below its final value because the gas is cold; at least 0."""
        dip_kpa = MAX_COOLING_RATIO * (self._slow_kpa - self._pressure_kpa)
        return dip_kpa if dip_kpa > 0 else 0.0  # 0 for NaN

    def warm_share(self, baseline_kpa: float) -> float:
        """Return the share of the heat of a contact that is still in the gas, from 0 to 1.

        The heat is that of the compression from `baseline_kpa` to the present pressure. The share is 1 at the
        beginning of a sudden contact, and 0 at rest.
        """
        warm_kpa = self._pressure_kpa - self._slow_kpa
        if not warm_kpa > 0:
            return 0.0
        rise_kpa = self._pressure_kpa - baseline_kpa
        return min(warm_kpa / rise_kpa, 1.0) if rise_kpa > 0 else 1.0
