"""Cold gas after a release: how far the locked pressure can be below its final value for a short time.

When a contact is released, the gas expands and cools. The walls warm the gas again, and the pressure recovers
from below to the pressure before the contact, because the amount of gas has not changed. The exponent of the
gas is not known. This module therefore computes the largest dip that the cooling explains.

The temperature follows T ~ p^((n−1)/n) during a fast change of the pressure p, and then returns to that of
the walls with a time constant. In a rigid vessel, the pressure error is therefore (1 − 1/n) times the
pressure after a high-pass filter with this time constant. A balloon gives way, so that its dip is smaller.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

#: Time constant with which the walls warm the gas. The slowest mode of heat conduction in a sphere with the
#: radius R has the time constant R²/(π²D). For air (D = 22 mm²/s) and R = 8.2 mm (8 kPa), it is 0.31 s.
HEAT_EXCHANGE_S = 0.3
#: 1 − 1/n for the gas exponent n = 1.2, the end of the range of the uncertainty budget. In the circuit of the
#: paper the dip is at most 0.63 of that in a rigid vessel, so that this value also covers n = 1.35.
MAX_COOLING_RATIO = 1 / 6


@dataclass(slots=True)
class ColdGas:
    """Largest dip of the pressure that is due to the cooling of the gas."""

    dip_kpa: float = 0.0  #: the pressure is at most this value below its final value; never negative
    _slow_kpa: float = math.nan  # pressure smoothed over `HEAT_EXCHANGE_S`

    def step(self, pressure_kpa: float, dt_s: float) -> None:
        """Process one sample of the pressure. NaN restarts the calculation with warm gas."""
        if not math.isfinite(self._slow_kpa + pressure_kpa):
            self._slow_kpa, self.dip_kpa = pressure_kpa, 0.0
            return
        self._slow_kpa += (pressure_kpa - self._slow_kpa) * min(dt_s / HEAT_EXCHANGE_S, 1.0)
        self.dip_kpa = MAX_COOLING_RATIO * max(self._slow_kpa - pressure_kpa, 0.0)
