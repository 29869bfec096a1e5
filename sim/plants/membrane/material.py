"""Rubber: tensions of a thin incompressible sheet at its principal stretches, and free inflation.

Mooney–Rivlin: W = μ/2 [(λ1² + λ2² + λ3² − 3) + α (λ1⁻² + λ2⁻² + λ3⁻² − 3)], λ3 = 1/(λ1 λ2).
Neo-Hookean: α = 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple, Protocol

import numpy as np

#: Largest tabulated radius of the free sphere, as a multiple of the radius at rest.
MAX_STRETCH = 4.0


class Tensions(NamedTuple):
    """Tensions per deformed length [kPa·mm] along the meridian and around the axis, with derivatives."""

    along: Any
    around: Any
    along_by_along: Any  #: ∂T1/∂λ1 [kPa·mm]
    along_by_around: Any  #: ∂T1/∂λ2 [kPa·mm]


class Material(Protocol):
    """Elastic skin of a closed balloon that is a sphere of `radius_mm` at rest."""

    @property
    def radius_mm(self) -> float:
        """Return the radius at rest [mm]."""
        ...

    def tensions(self, along: Any, around: Any) -> Tensions:
        """Return the tensions at the stretches λ1 along the meridian and λ2 around the axis."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Rubber:
    """Rubber skin.

    The defaults are the Mooney–Rivlin balloon whose free inflation fits R_i(ΔP_i) of the paper best.
    """

    mu_kpa: float = 263.022
    alpha: float = 0.38907
    radius_mm: float = 7.503
    thickness_mm: float = 0.2

    def tensions(self, along: Any, around: Any) -> Tensions:
        """Return T1 = μh₀ (λ1/λ2 − (λ1λ2)⁻³)(1 + αλ2²), and T2 with exchanged indices 1 and 2."""
        stiffness = self.mu_kpa * self.thickness_mm
        thinning = 1 / (along * around)
        thinning = thinning * thinning * thinning
        hoop = stiffness * (1 + self.alpha * around * around)
        pull = along / around - thinning
        return Tensions(
            hoop * pull,
            stiffness * (around / along - thinning) * (1 + self.alpha * along * along),
            hoop * (1 / around + 3 * thinning / along),
            hoop * (3 * thinning - along / around) / around + 2 * stiffness * self.alpha * around * pull,
        )

    def free_kpa(self, stretch: Any) -> Any:
        """Return the pressure [kPa] of the free sphere at a stretch: ΔP = (2μh₀/R₀)(λ⁻¹ − λ⁻⁷)(1 + αλ²)."""
        stiffness = 2 * self.mu_kpa * self.thickness_mm / self.radius_mm
        return stiffness * (1 / stretch - stretch**-7) * (1 + self.alpha * stretch * stretch)

    def free_slope_kpa(self, stretch: Any) -> Any:
        """Return dΔP/dλ [kPa] of the free sphere. It is zero at the limit point, λ = 7^(1/6) if α = 0."""
        stiffness = 2 * self.mu_kpa * self.thickness_mm / self.radius_mm
        return stiffness * (7 * stretch**-8 - stretch**-2 + self.alpha * (1 + 5 * stretch**-6))

    def free_stretch(self, pressure_kpa: Any) -> Any:
        """Return the stretch of the free sphere at a pressure, up to the limit point; 1 without pressure."""
        stretches, pressures_kpa = _rising_branch(self)
        return np.interp(pressure_kpa, pressures_kpa, stretches)


@cache
def _rising_branch(rubber: Rubber) -> tuple[Any, Any]:
    """Return stretches and pressures [kPa] of the free sphere, up to its limit point."""
    stretches = np.linspace(1.0, MAX_STRETCH, 30_001)
    falling = np.flatnonzero(rubber.free_slope_kpa(stretches) < 0)
    stretches = stretches[: falling[0] if falling.size else None]
    return stretches, rubber.free_kpa(stretches)


MOONEY_RIVLIN = Rubber()
NEO_HOOKEAN = Rubber(mu_kpa=391.665, alpha=0.0)
