"""Gas flow through an orifice (ISO 6358-1): choked, subsonic, or laminar at a small pressure drop."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

#: Reference pressure of ISO 6358 (ISO 8778) [kPa]. Flows are converted to the reference temperature, 20 °C.
REFERENCE_KPA = 100.0
#: Pressure ratio above which the flow is laminar (ISO 6358-1: 0.999): proportional to the pressure drop. With
#: the ellipse instead, the simulated flow would oscillate when the pressures are nearly equal.
LAMINAR_RATIO = 0.999


@dataclass(frozen=True, slots=True)
class Orifice:
    """Flow restriction with sonic conductance C and critical pressure ratio b."""

    conductance_mm3_per_s_kpa: float
    critical_ratio: float
    laminar_ratio: float = LAMINAR_RATIO
    _laminar_share: float = field(init=False)

    def __post_init__(self) -> None:
        """Compute the flow at the laminar ratio. At this ratio, the laminar line meets the ellipse."""
        object.__setattr__(self, "_laminar_share", self._ellipse(self.laminar_ratio))

    def flow(self, upstream_kpa: float, downstream_kpa: float) -> float:
        """Return the flow [kPa·mm³/s at 20 °C] between two absolute pressures.

        The flow is negative if the downstream pressure is higher.
        """
        if downstream_kpa > upstream_kpa:
            return -self.flow(downstream_kpa, upstream_kpa)
        ratio = downstream_kpa / upstream_kpa
        if ratio <= self.critical_ratio:
            share = 1.0
        elif ratio < self.laminar_ratio:
            share = self._ellipse(ratio)
        else:
            share = self._laminar_share * (1 - ratio) / (1 - self.laminar_ratio)
        return REFERENCE_KPA * self.conductance_mm3_per_s_kpa * upstream_kpa * share

    def _ellipse(self, ratio: float) -> float:
        """Return the fraction of the choked flow, √(1 − ((r − b)/(1 − b))²)."""
        return math.sqrt(1 - ((ratio - self.critical_ratio) / (1 - self.critical_ratio)) ** 2)
