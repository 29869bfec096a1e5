"""What the sensor is made of, and its shape when inflated without contact."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

#: A float, a complex number (for exact derivatives) or an array: the equations are the same for each.
Number = Any

#: Range of ΔP_i that the paper validated [kPa].
VALID_LOW_KPA = 4.95
VALID_HIGH_KPA = 11.45
#: Rise below which the paper interpolates the force to zero [kPa].
LOWEST_RISE_KPA = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Balloon:
    """The latex membrane of the paper (Section IV-A) and its measured radius (Section IV-B, Fig. 4)."""

    young_kpa: float = 2000.0
    poisson: float = 0.5
    rest_radius_mm: float = 7.503
    rest_thickness_mm: float = 0.2
    radius_linear_mm_per_kpa: float = 44.652e-3
    radius_quadratic_mm_per_kpa2: float = 5.9695e-3
    switch_kpa: float = 8.85  #: above this ΔP_i the stretching energy is (4), below it (5)

    def radius_mm(self, pressure_kpa: Number) -> Number:
        """Radius R_i [mm] of the free balloon at gauge pressure ΔP_i (quadratic of Fig. 4)."""
        return (
            self.rest_radius_mm
            + (self.radius_quadratic_mm_per_kpa2 * pressure_kpa + self.radius_linear_mm_per_kpa)
            * pressure_kpa
        )

    def thickness_mm(self, radius_mm: Number) -> Number:
        """Membrane thickness h [mm] at radius R_i: the membrane's own volume is constant."""
        return self.rest_thickness_mm * (self.rest_radius_mm / radius_mm) ** 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Circuit:
    """The gas around the balloon: volume V_c of all pipes, and the pressure P_0 outside the balloon."""

    volume_mm3: float = 12.68e3
    ambient_kpa: float = 101.325
    #: Exponent n of the gas during a contact: 1 isothermal (the paper's), 1.4 adiabatic.
    polytropic: float = 1.0


def sphere_volume(radius_mm: Number) -> Number:
    """Volume [mm³] of a sphere."""
    return (4 / 3 * math.pi) * radius_mm**3


def within(x: Number, low: float, high: float) -> Number:
    """The nearest number of a span; floats or arrays."""
    return (abs(x - low) - abs(x - high) + low + high) / 2
