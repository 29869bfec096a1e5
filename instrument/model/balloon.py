"""Balloon and gas circuit: material constants, and the shape of the inflated balloon without contact."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

#: A float, an array, or a complex number (for complex-step derivatives). All three use the same equations.
Number = Any

#: Range of ΔP_i that the paper validated [kPa].
VALID_LOW_KPA = 4.95
VALID_HIGH_KPA = 11.45
#: Smallest rise ΔP_f − ΔP_i at which the force law is valid [kPa]. At a smaller rise, the force is
#: interpolated to zero.
MIN_RISE_KPA = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class SkinConstants:
    """Mooney–Rivlin constants of a thin skin, which contain its thickness (`rubber`)."""

    rest_radius_mm: float
    c1_kpa_mm: float
    c2_kpa_mm: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Balloon:
    """Latex membrane of the paper (Section IV-A) and its measured radius (Section IV-B, Fig. 4)."""

    young_kpa: float = 2000.0  #: Young's modulus E
    poisson: float = 0.5  #: Poisson's ratio ν
    rest_radius_mm: float = 7.503  #: radius R_0 without pressure
    rest_thickness_mm: float = 0.2  #: thickness h_0 without pressure
    radius_linear_mm_per_kpa: float = 44.652e-3
    radius_quadratic_mm_per_kpa2: float = 5.9695e-3
    switch_kpa: float = 8.85  #: ΔP_i above which eq. (4) gives the stretching energy; below, eq. (5)

    #: Constants fitted to the measured radii, for the method "membrane". None: fitted to the quadratic.
    skin: SkinConstants | None = None

    @property
    def is_measured(self) -> bool:
        """Return True if the radii are not those of the paper, or if a skin was fitted to measured radii."""
        paper = Balloon()
        return self.skin is not None or (
            self.rest_radius_mm,
            self.radius_linear_mm_per_kpa,
            self.radius_quadratic_mm_per_kpa2,
        ) != (paper.rest_radius_mm, paper.radius_linear_mm_per_kpa, paper.radius_quadratic_mm_per_kpa2)

    def radius_mm(self, pressure_kpa: Number) -> Number:
        """Return the radius R_i [mm] of the free balloon at gauge pressure ΔP_i (quadratic of Fig. 4)."""
        return (
            self.rest_radius_mm
            + (self.radius_quadratic_mm_per_kpa2 * pressure_kpa + self.radius_linear_mm_per_kpa)
            * pressure_kpa
        )

    def thickness_mm(self, radius_mm: Number) -> Number:
        """Return the membrane thickness h [mm] at radius R_i. The volume of the membrane is constant."""
        return self.rest_thickness_mm * (self.rest_radius_mm / radius_mm) ** 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Circuit:
    """Gas circuit of the balloon: volume V_c of all tubes, and the pressure P_0 outside the balloon."""

    volume_mm3: float = 12.68e3
    ambient_kpa: float = 101.325
    #: Polytropic exponent n of the gas during a contact: 1 is isothermal (as in the paper), 1.4 is adiabatic.
    polytropic: float = 1.0


def sphere_volume_mm3(radius_mm: Number) -> Number:
    """Return the volume [mm³] of a sphere."""
    return (4 / 3 * math.pi) * radius_mm**3


def clamp(x: Number, low: float, high: float) -> Number:
    """Return `x` limited to the span from `low` to `high`. `x` is a float or an array."""
    return (abs(x - low) - abs(x - high) + low + high) / 2
