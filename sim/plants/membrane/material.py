"""Rubber: tensions of a thin incompressible sheet at its principal stretches, and free inflation.

Each law gives the strain energy W of a volume at the stretches λ1, λ2 and λ3 = 1/(λ1 λ2).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
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
class Rubber(ABC):
    """Rubber skin, and its free inflation. Each subclass is one law of rubber elasticity."""

    mu_kpa: float
    radius_mm: float = 7.503
    thickness_mm: float = 0.2

    @abstractmethod
    def tensions(self, along: Any, around: Any) -> Tensions:
        """Return the tensions at the stretches λ1 along the meridian and λ2 around the axis."""

    def free_kpa(self, stretch: Any) -> Any:
        """Return the pressure [kPa] of the free sphere at a stretch, by Laplace: ΔP = 2T/(R₀λ)."""
        return 2 * self.tensions(stretch, stretch).along / (self.radius_mm * stretch)

    def free_slope_kpa(self, stretch: Any) -> Any:
        """Return dΔP/dλ [kPa] of the free sphere. The slope is zero at a limit point."""
        tensions = self.tensions(stretch, stretch)
        steepness = tensions.along_by_along + tensions.along_by_around - tensions.along / stretch
        return 2 * steepness / (self.radius_mm * stretch)

    def free_stretch(self, pressure_kpa: Any) -> Any:
        """Return the stretch of the free sphere at a pressure, up to the limit point; 1 without pressure."""
        stretches, pressures_kpa = rising_branch(self)
        return np.interp(pressure_kpa, pressures_kpa, stretches)


@dataclass(frozen=True, slots=True, kw_only=True)
class MooneyRivlin(Rubber):
    """W = μ/2 [(λ1² + λ2² + λ3² − 3) + α (λ1⁻² + λ2⁻² + λ3⁻² − 3)]. With α = 0, the law is neo-Hookean."""

    mu_kpa: float = 263.022
    alpha: float = 0.38907

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


@dataclass(frozen=True, slots=True, kw_only=True)
class Gent(Rubber):
    """W = −μJ_m/2 ln(1 − J/J_m), J = λ1² + λ2² + λ3² − 3 < J_m (Gent, Rubber Chem. Technol. 69, 1996)."""

    mu_kpa: float = 389.664
    locking: float = 30.0  #: J_m, the value of J at which the molecules are completely stretched

    def tensions(self, along: Any, around: Any) -> Tensions:
        """Return T1 = μh₀ (λ1/λ2 − (λ1λ2)⁻³) J_m/(J_m − J), and T2 with exchanged indices 1 and 2.

        The tensions are NaN if J ≥ J_m.
        """
        thinning = 1 / (along * around)
        thinning = thinning * thinning * thinning
        squares = along * along + around * around + thinning * along * around
        left = self.locking + 3 - squares
        left = np.where(np.real(left) > 0, left, np.nan)
        stiffness = self.mu_kpa * self.thickness_mm * self.locking / left
        pull, pull_around = along / around - thinning, around / along - thinning
        return Tensions(
            stiffness * pull,
            stiffness * pull_around,
            stiffness * (1 / around + 3 * thinning / along + 2 * pull * pull * around / left),
            stiffness * ((3 * thinning - along / around) / around + 2 * pull * pull_around * along / left),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Ogden(Rubber):
    """W = Σ μ_p/α_p (λ1^α_p + λ2^α_p + λ3^α_p − 3), with μ_p = `mu_kpa` · ratio (Ogden 1972).

    The exponents and the ratios are those of R. W. Ogden, Proc. R. Soc. Lond. A 326 (1972), for the data of
    Treloar: μ_p = 6.3, 0.012 and −0.1 kg/cm². The ratios here are relative to the first term.
    """

    mu_kpa: float = 565.431
    exponents: tuple[float, ...] = (1.3, 5.0, -2.0)
    ratios: tuple[float, ...] = (1.0, 0.012 / 6.3, -0.1 / 6.3)

    def tensions(self, along: Any, around: Any) -> Tensions:
        """Return T1 = h₀/(λ1λ2) Σ μ_p (λ1^α_p − (λ1λ2)^−α_p), and T2 with exchanged indices 1 and 2."""
        log_along, log_around = np.log(along), np.log(around)
        pull = pull_around = by_along = by_around = 0.0
        for exponent, ratio in zip(self.exponents, self.ratios, strict=True):
            meridian, hoop = np.exp(exponent * log_along), np.exp(exponent * log_around)
            normal = 1 / (meridian * hoop)
            pull = pull + ratio * (meridian - normal)
            pull_around = pull_around + ratio * (hoop - normal)
            by_along = by_along + ratio * exponent * (meridian + normal)
            by_around = by_around + ratio * exponent * normal
        stiffness = self.mu_kpa * self.thickness_mm / (along * around)
        return Tensions(
            stiffness * pull,
            stiffness * pull_around,
            stiffness * (by_along - pull) / along,
            stiffness * (by_around - pull) / around,
        )


@dataclass(frozen=True, slots=True)
class Skin:
    """Skin of a balloon whose thickness at rest is h₀ (1 + e cos φ), with the angle φ from the nearest pole.

    `unevenness` is e. A skin with e > 0 is thicker at the poles, and thinner with e < 0.
    """

    material: Material
    unevenness: float = 0.0

    def thickness(self, cosine: Any) -> Any:
        """Return the thickness at rest as a multiple of h₀, for values of cos φ."""
        return 1 + self.unevenness * cosine


@cache
def rising_branch(rubber: Rubber) -> tuple[Any, Any]:
    """Return stretches and pressures [kPa] of the free sphere, up to its limit point."""
    stretches = np.linspace(1.0, MAX_STRETCH, 30_001)
    ended = np.flatnonzero(~(rubber.free_slope_kpa(stretches) >= 0))
    stretches = stretches[: ended[0] if ended.size else None]
    return stretches, rubber.free_kpa(stretches)


#: Rubbers whose free inflation fits R_i(ΔP_i) of the paper best, by name.
RUBBERS: dict[str, Rubber] = {
    "mooney-rivlin": MooneyRivlin(),
    "neo-hookean": MooneyRivlin(mu_kpa=391.665, alpha=0.0),
    "gent": Gent(),
    "ogden": Ogden(),
}
MOONEY_RIVLIN, NEO_HOOKEAN = RUBBERS["mooney-rivlin"], RUBBERS["neo-hookean"]
