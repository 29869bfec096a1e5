"""The three force balances. Each gives the reaction of the membrane minus ΔP_f π a², in mN, and its slope.

A balance is negative below its physical root in d and positive above it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

from instrument.model.balloon import Number
from instrument.model.pressed import Pressed, Shape, shape


def energetic(indentation_mm: Number, pressed: Pressed) -> tuple[Number, Number]:
    """Equation (8) minus (1), times c² (which keeps it smooth up to d = R_i), and its derivative by d.

    F = ½ d/dd [E_str + E_bend] along R_f(d): the gas volume is fixed by the measured pressure on that
    curve, so the compression energy (7) has no part in the derivative.
    """
    s = shape(indentation_mm, pressed)
    str1, str2 = stretching_force(indentation_mm, pressed, s)
    bend1, bend2 = bending_force(pressed, s)
    force = (math.pi * pressed.final_kpa) * s.a_squared
    slope = (math.pi * pressed.final_kpa) * s.a_squared1
    excess, excess1 = str1 + bend1 - force, str2 + bend2 - slope
    return s.gap * s.gap * excess, s.gap * (s.gap * excess1 - 2 * excess)


def stretching_force(indentation_mm: Number, pressed: Pressed, s: Shape) -> tuple[Number, Number]:
    """½ dE_str/dd [mN] and its derivative: (4), (5), or a mixture by `small_strain`.

    With the cap's chord s = √(2 R_i d), R_i d is s²/2 and the second term of (5) is (a − s)²/2.
    """
    R = pressed.radius_mm
    half_k = 2 * math.pi * pressed.young_kpa * pressed.thickness_mm / (1 - pressed.poisson)
    e = s.rf - R
    sphere1 = 2 * e * s.rf1
    sphere2 = 2 * (s.rf1 * s.rf1 + e * s.rf2)
    chord = (2 * R * indentation_mm) ** 0.5
    chord1 = R / chord
    chord2 = -chord1 * chord1 / chord
    f, f1, f2 = s.a - chord, s.a1 - chord1, s.a2 - chord2
    caps1 = (sphere1 * s.gap - e * e) / R + f * f1
    caps2 = (sphere2 * s.gap - 2 * sphere1) / R + f1 * f1 + f * f2
    w = pressed.small_strain
    return half_k * (w * sphere1 + (1 - w) * caps1), half_k * (w * sphere2 + (1 - w) * caps2)


def bending_force(pressed: Pressed, s: Shape) -> tuple[Number, Number]:
    """½ dE_bend/dd [mN] and its derivative, E_bend = (E h² π/12) a³/R_f², after (6)."""
    b = math.pi / 24 * pressed.young_kpa * pressed.thickness_mm**2 * s.a * s.a_squared / s.rf_squared
    a_log, rf_log = s.a_squared1 / s.a_squared, s.rf_squared1 / s.rf_squared
    log1 = 1.5 * a_log - rf_log
    log2 = 1.5 * (s.a_squared2 / s.a_squared - a_log * a_log) - (
        s.rf_squared2 / s.rf_squared - rf_log * rf_log
    )
    return b * log1, b * (log1 * log1 + log2)


def energetic_final_radius(indentation_mm: Number, pressed: Pressed) -> Number:
    """R_f [mm] of the energetic method, eq. (9)."""
    return shape(indentation_mm, pressed).rf


def lulevich(indentation_mm: Number, pressed: Pressed) -> tuple[Number, Number]:
    """Equation (2) minus (1) with R_f = R_i + d²/(2R_i): constant volume, small deformations."""
    R, d = pressed.radius_mm, indentation_mm
    reaction, reaction1 = _small_deformation_reaction(d, pressed)
    a_squared = 2 * R * d + d**4 / (4 * R * R)
    a_squared1 = 2 * R + d**3 / (R * R)
    return (
        reaction - (math.pi * pressed.final_kpa) * a_squared,
        reaction1 - (math.pi * pressed.final_kpa) * a_squared1,
    )


def lulevich_final_radius(indentation_mm: Number, pressed: Pressed) -> Number:
    """R_f [mm] of Lulevich's method."""
    return pressed.radius_mm + indentation_mm**2 / (2 * pressed.radius_mm)


def shanahan(indentation_mm: Number, pressed: Pressed) -> tuple[Number, Number]:
    """Equation (2) minus (1) with R_f = R_i + ΔR, ΔR from (3)."""
    c = pressed.radius_mm - indentation_mm
    rf = shanahan_final_radius(indentation_mm, pressed)
    reaction, reaction1 = _small_deformation_reaction(indentation_mm, pressed)
    pressure = math.pi * pressed.final_kpa
    return reaction - pressure * (rf * rf - c * c), reaction1 - 2 * pressure * c


def shanahan_final_radius(indentation_mm: Number, pressed: Pressed) -> Number:  # noqa: ARG001
    """R_f [mm] of Shanahan's method, eq. (3)."""
    R = pressed.radius_mm
    load = R * (1 - pressed.poisson) * pressed.rise_kpa
    return R + R * load / (2 * pressed.young_kpa * pressed.thickness_mm - load)


def _small_deformation_reaction(d: Number, pressed: Pressed) -> tuple[Number, Number]:
    """Equation (2) [mN] and its derivative by d."""
    stretch, bend = _small_deformation_stiffness(pressed)
    root = d**0.5
    return stretch * d**3 + bend * root, 3 * stretch * d * d + bend / (2 * root)


def _small_deformation_stiffness(pressed: Pressed) -> tuple[Number, Number]:
    """Factors of d³ and √d in equation (2)."""
    R, h = pressed.radius_mm, pressed.thickness_mm
    stretch = 2 * math.pi * pressed.young_kpa * h / ((1 - pressed.poisson) * R * R)
    return stretch, math.pi / math.sqrt(2) * pressed.young_kpa * h * h / R**0.5


def above_bending_root(pressed: Pressed) -> Number:
    """Indentation [mm] above the spurious root of (2), where bending alone would carry the force.

    It is where (2)/d, a falling bending term plus a rising stretching term, is least.
    """
    stretch, bend = _small_deformation_stiffness(pressed)
    return (bend / (4 * stretch)) ** 0.4


def above_touching_root(pressed: Pressed) -> Number:
    """Indentation [mm] above the spurious root of (8) = (1), which lies within 1e-3 mm of d_min (a = 0)."""
    return pressed.least_indentation_mm + 1e-2


class Method(NamedTuple):
    """One way to turn two pressures into d: its balance, and the radius R_f that it believes in."""

    balance: Callable[[Number, Pressed], tuple[Number, Number]]
    final_radius_mm: Callable[[Number, Pressed], Number]
    lowest_mm: Callable[[Pressed], Number]  #: an indentation between the spurious root and the physical one


METHODS: Mapping[str, Method] = {
    "energetic": Method(energetic, energetic_final_radius, above_touching_root),
    "lulevich": Method(lulevich, lulevich_final_radius, above_bending_root),
    "shanahan": Method(shanahan, shanahan_final_radius, above_bending_root),
}
