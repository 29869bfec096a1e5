"""Force balances of the three methods, and their derivatives with respect to the indentation d.

A balance is the reaction of the membrane minus ΔP_f π a² [mN]. It is negative below the physical root d and
positive above.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

from pneuforce.instrument.model.balloon import Number
from pneuforce.instrument.model.contact_geometry import ContactGeometry, ContactShape, contact_shape


def energetic_balance(indentation_mm: Number, geometry: ContactGeometry) -> tuple[Number, Number]:
    """Return the balance of the energetic method and its derivative with respect to d.

    The balance is (eq. (8) − eq. (1))·c². The factor c² keeps the balance smooth up to d = R_i. The reaction
    is F = ½ d/dd [E_str + E_bend] along R_f(d). The measured pressure fixes the gas volume on this curve, so
    the compression energy (7) adds nothing to the derivative.
    """
    s = contact_shape(indentation_mm, geometry)
    str1, str2 = stretching_force(indentation_mm, geometry, s)
    bend1, bend2 = bending_force(geometry, s)
    force = (math.pi * geometry.final_kpa) * s.a_squared
    slope = (math.pi * geometry.final_kpa) * s.a_squared1
    excess, excess1 = str1 + bend1 - force, str2 + bend2 - slope
    return s.gap * s.gap * excess, s.gap * (s.gap * excess1 - 2 * excess)


def stretching_force(
    indentation_mm: Number, geometry: ContactGeometry, s: ContactShape
) -> tuple[Number, Number]:
    """Return ½ dE_str/dd [mN] and its derivative with respect to d.

    E_str is the mean of (4) and (5), weighted by `small_strain_weight`. The chord of the cap is √(2 R_i d),
    so the second term of (5) is (a − chord)²/2.
    """
    R = geometry.radius_mm
    half_k = 2 * math.pi * geometry.young_kpa * geometry.thickness_mm / (1 - geometry.poisson)
    e = s.rf - R
    sphere1 = 2 * e * s.rf1
    sphere2 = 2 * (s.rf1 * s.rf1 + e * s.rf2)
    chord = (2 * R * indentation_mm) ** 0.5
    chord1 = R / chord
    chord2 = -chord1 * chord1 / chord
    f, f1, f2 = s.a - chord, s.a1 - chord1, s.a2 - chord2
    caps1 = (sphere1 * s.gap - e * e) / R + f * f1
    caps2 = (sphere2 * s.gap - 2 * sphere1) / R + f1 * f1 + f * f2
    w = geometry.small_strain_weight
    return half_k * (w * sphere1 + (1 - w) * caps1), half_k * (w * sphere2 + (1 - w) * caps2)


def bending_force(geometry: ContactGeometry, s: ContactShape) -> tuple[Number, Number]:
    """Return ½ dE_bend/dd [mN] and its derivative with respect to d.

    Eq. (6) gives E_bend = (E h² π/12) a³/R_f².
    """
    b = math.pi / 24 * geometry.young_kpa * geometry.thickness_mm**2 * s.a * s.a_squared / s.rf_squared
    a_log, rf_log = s.a_squared1 / s.a_squared, s.rf_squared1 / s.rf_squared
    log1 = 1.5 * a_log - rf_log
    log2 = 1.5 * (s.a_squared2 / s.a_squared - a_log * a_log) - (
        s.rf_squared2 / s.rf_squared - rf_log * rf_log
    )
    return b * log1, b * (log1 * log1 + log2)


def energetic_final_radius(indentation_mm: Number, geometry: ContactGeometry) -> Number:
    """Return R_f [mm] of the energetic method, eq. (9)."""
    return contact_shape(indentation_mm, geometry).rf


def lulevich_balance(indentation_mm: Number, geometry: ContactGeometry) -> tuple[Number, Number]:
    """Return the balance of Lulevich's method and its derivative with respect to d.

    The balance is eq. (2) − eq. (1) with R_f = R_i + d²/(2R_i), for constant volume and small deformations.
    """
    R, d = geometry.radius_mm, indentation_mm
    reaction, reaction1 = _small_deformation_reaction(d, geometry)
    a_squared = 2 * R * d + d**4 / (4 * R * R)
    a_squared1 = 2 * R + d**3 / (R * R)
    return (
        reaction - (math.pi * geometry.final_kpa) * a_squared,
        reaction1 - (math.pi * geometry.final_kpa) * a_squared1,
    )


def lulevich_final_radius(indentation_mm: Number, geometry: ContactGeometry) -> Number:
    """Return R_f [mm] of Lulevich's method."""
    return geometry.radius_mm + indentation_mm**2 / (2 * geometry.radius_mm)


def shanahan_balance(indentation_mm: Number, geometry: ContactGeometry) -> tuple[Number, Number]:
    """Return the balance of Shanahan's method and its derivative with respect to d.

    The balance is eq. (2) − eq. (1) with R_f = R_i + ΔR. ΔR follows from eq. (3).
    """
    c = geometry.radius_mm - indentation_mm
    rf = shanahan_final_radius(indentation_mm, geometry)
    reaction, reaction1 = _small_deformation_reaction(indentation_mm, geometry)
    pressure = math.pi * geometry.final_kpa
    return reaction - pressure * (rf * rf - c * c), reaction1 - 2 * pressure * c


def shanahan_final_radius(indentation_mm: Number, geometry: ContactGeometry) -> Number:  # noqa: ARG001
    """Return R_f [mm] of Shanahan's method, eq. (3). R_f does not depend on the indentation."""
    R = geometry.radius_mm
    load = R * (1 - geometry.poisson) * geometry.rise_kpa
    return R + R * load / (2 * geometry.young_kpa * geometry.thickness_mm - load)


def _small_deformation_reaction(d: Number, geometry: ContactGeometry) -> tuple[Number, Number]:
    """Return the force of equation (2) [mN] and its derivative with respect to d."""
    stretch, bend = _small_deformation_stiffness(geometry)
    root = d**0.5
    return stretch * d**3 + bend * root, 3 * stretch * d * d + bend / (2 * root)


def _small_deformation_stiffness(geometry: ContactGeometry) -> tuple[Number, Number]:
    """Return the factors of d³ and √d in equation (2)."""
    R, h = geometry.radius_mm, geometry.thickness_mm
    stretch = 2 * math.pi * geometry.young_kpa * h / ((1 - geometry.poisson) * R * R)
    return stretch, math.pi / math.sqrt(2) * geometry.young_kpa * h * h / R**0.5


def above_bending_root(geometry: ContactGeometry) -> Number:
    """Return an indentation [mm] that separates the two roots of equations (2) = (1) of the paper.

    At the spurious root, bending alone carries the force. The returned d minimizes F/d with F from eq. (2).
    F/d is the sum of a bending term that falls with d and a stretching term that rises with d.
    """
    stretch, bend = _small_deformation_stiffness(geometry)
    return (bend / (4 * stretch)) ** 0.4


def above_touching_root(geometry: ContactGeometry) -> Number:
    """Return an indentation [mm] between the spurious and the physical root of (8) = (1).

    The spurious root lies within 1e-3 mm of d_min, where a = 0.
    """
    return geometry.min_indentation_mm + 1e-2


class ForceMethod(NamedTuple):
    """Force method: the force balance that determines d from two pressures, and the radius R_f."""

    balance: Callable[[Number, ContactGeometry], tuple[Number, Number]]
    final_radius_mm: Callable[[Number, ContactGeometry], Number]
    #: Function that returns an indentation between the spurious root and the physical root.
    lower_bound_mm: Callable[[ContactGeometry], Number]


METHODS: Mapping[str, ForceMethod] = {
    "energetic": ForceMethod(energetic_balance, energetic_final_radius, above_touching_root),
    "lulevich": ForceMethod(lulevich_balance, lulevich_final_radius, above_bending_root),
    "shanahan": ForceMethod(shanahan_balance, shanahan_final_radius, above_bending_root),
}
