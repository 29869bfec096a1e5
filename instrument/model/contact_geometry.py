"""The balloon in contact: a sphere of radius R_f cut by two planes, full of isothermally compressed gas."""

from __future__ import annotations

import math
from typing import NamedTuple

from instrument.model.balloon import Balloon, Circuit, Number, sphere_volume


class Pressed(NamedTuple):
    """One contact as the two pressures fix it; d is still open. Floats, complex numbers or arrays."""

    rise_kpa: Number  #: ΔP_f − ΔP_i
    final_kpa: Number  #: ΔP_f
    radius_mm: Number  #: R_i
    thickness_mm: Number  #: h
    volume_mm3: Number  #: V_b, the balloon's share of the gas after contact
    small_strain: Number  #: weight of stretching energy (4); 1 − weight goes to (5)
    young_kpa: Number
    poisson: Number

    @classmethod
    def between(
        cls,
        initial_kpa: Number,
        final_kpa: Number,
        small_strain: Number,
        balloon: Balloon,
        circuit: Circuit,
        radius_error_mm: Number = 0.0,
    ) -> Pressed:
        """The contact that raised the gauge pressure from ΔP_i to ΔP_f: p·Vⁿ is kept, then eq. (9)."""
        radius = balloon.radius_mm(initial_kpa) + radius_error_mm
        before = circuit.volume_mm3 + sphere_volume(radius)
        expansion = (circuit.ambient_kpa + initial_kpa) / (circuit.ambient_kpa + final_kpa)
        after = before * expansion ** (1 / circuit.polytropic)
        return cls(
            final_kpa - initial_kpa,
            final_kpa,
            radius,
            balloon.thickness_mm(radius),
            after - circuit.volume_mm3,
            small_strain,
            balloon.young_kpa,
            balloon.poisson,
        )

    @property
    def least_indentation_mm(self) -> Number:
        """d_min = R_i − (3V_b/4π)^(1/3) [mm], where the contact radius is 0; beyond R_i where V_b ≤ 0."""
        cube = self.volume_mm3 * (3 / (4 * math.pi))
        return self.radius_mm - cube / (abs(cube) + 1e-300) ** (2 / 3)


class Shape(NamedTuple):
    """Radii of the pressed balloon at one d, with first and second derivatives by d (P_f fixed)."""

    gap: Number  #: c = R_i − d, half the distance between the planes [mm]
    rf: Number
    rf1: Number
    rf2: Number
    rf_squared: Number
    rf_squared1: Number
    rf_squared2: Number
    a: Number
    a1: Number
    a2: Number
    a_squared: Number
    a_squared1: Number
    a_squared2: Number


def shape(indentation_mm: Number, pressed: Pressed) -> Shape:
    """R_f and a at indentation d, from eq. (9) solved for R_f: R_f² = V_b/(2πc) + c²/3, a² = R_f² − c²."""
    c = pressed.radius_mm - indentation_mm
    q = pressed.volume_mm3 / ((2 * math.pi) * c)
    rf_squared, a_squared = q + c * c / 3, q - 2 / 3 * c * c
    rf_squared1, a_squared1 = q / c - 2 / 3 * c, q / c + 4 / 3 * c
    rf_squared2, a_squared2 = 2 * q / (c * c) + 2 / 3, 2 * q / (c * c) - 4 / 3
    rf, a = rf_squared**0.5, a_squared**0.5
    rf1, a1 = rf_squared1 / (2 * rf), a_squared1 / (2 * a)
    rf2, a2 = (rf_squared2 / 2 - rf1 * rf1) / rf, (a_squared2 / 2 - a1 * a1) / a
    return Shape(
        c, rf, rf1, rf2, rf_squared, rf_squared1, rf_squared2, a, a1, a2, a_squared, a_squared1, a_squared2
    )
