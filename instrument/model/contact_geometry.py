"""Geometry of a contact: a sphere of radius R_f cut by two parallel planes and filled with compressed gas."""

from __future__ import annotations

import math
from typing import NamedTuple

from pneuforce.instrument.model.balloon import Balloon, Circuit, Number, sphere_volume_mm3


class ContactGeometry(NamedTuple):
    """Quantities of a contact that follow from the two pressures alone, without the indentation d.

    The fields are floats, complex numbers or arrays.
    """

    rise_kpa: Number  #: ΔP_f − ΔP_i
    final_kpa: Number  #: ΔP_f
    radius_mm: Number  #: radius R_i before the contact
    thickness_mm: Number  #: thickness h of the membrane
    volume_mm3: Number  #: volume V_b of the gas in the balloon during the contact
    small_strain_weight: Number  #: weight of stretching energy (4); 1 − weight is the weight of (5)
    young_kpa: Number
    poisson: Number

    @classmethod
    def between(
        cls,
        baseline_kpa: Number,
        final_kpa: Number,
        small_strain_weight: Number,
        balloon: Balloon,
        circuit: Circuit,
        radius_error_mm: Number = 0.0,
    ) -> ContactGeometry:
        """Return the geometry of the contact that raises the gauge pressure from ΔP_i to ΔP_f.

        The quantity p·Vⁿ of the gas is constant. `radius_error_mm` is added to R_i, so that derivatives with
        respect to R_i can be computed.
        """
        radius = balloon.radius_mm(baseline_kpa) + radius_error_mm
        volume_before = circuit.volume_mm3 + sphere_volume_mm3(radius)
        pressure_ratio = (circuit.ambient_kpa + baseline_kpa) / (circuit.ambient_kpa + final_kpa)
        volume_after = volume_before * pressure_ratio ** (1 / circuit.polytropic)
        return cls(
            final_kpa - baseline_kpa,
            final_kpa,
            radius,
            balloon.thickness_mm(radius),
            volume_after - circuit.volume_mm3,
            small_strain_weight,
            balloon.young_kpa,
            balloon.poisson,
        )

    @property
    def min_indentation_mm(self) -> Number:
        """Return d_min = R_i − (3V_b/4π)^(1/3) [mm], the indentation at which the contact radius is 0.

        If V_b ≤ 0, the result is R_i or more, so that no indentation is valid.
        """
        cube = self.volume_mm3 * (3 / (4 * math.pi))
        return self.radius_mm - cube / (abs(cube) + 1e-300) ** (2 / 3)


class ContactShape(NamedTuple):
    """Radii of the pressed balloon at one indentation d, with derivatives at constant ΔP_f.

    The suffixes 1 and 2 mark the first and second derivative with respect to d.
    """

    gap: Number  #: c = R_i − d, half the distance between the two planes that cut the sphere [mm]
    rf: Number  #: R_f [mm]
    rf1: Number
    rf2: Number
    rf_squared: Number
    rf_squared1: Number
    rf_squared2: Number
    a: Number  #: contact radius [mm]
    a1: Number
    a2: Number
    a_squared: Number
    a_squared1: Number
    a_squared2: Number


def contact_shape(indentation_mm: Number, geometry: ContactGeometry) -> ContactShape:
    """Return R_f, a and their derivatives at indentation d.

    Equation (9) gives R_f² = V_b/(2πc) + c²/3 and a² = R_f² − c², with c = R_i − d.
    """
    c = geometry.radius_mm - indentation_mm
    q = geometry.volume_mm3 / ((2 * math.pi) * c)
    rf_squared, a_squared = q + c * c / 3, q - 2 / 3 * c * c
    rf_squared1, a_squared1 = q / c - 2 / 3 * c, q / c + 4 / 3 * c
    rf_squared2, a_squared2 = 2 * q / (c * c) + 2 / 3, 2 * q / (c * c) - 4 / 3
    rf, a = rf_squared**0.5, a_squared**0.5
    rf1, a1 = rf_squared1 / (2 * rf), a_squared1 / (2 * a)
    rf2, a2 = (rf_squared2 / 2 - rf1 * rf1) / rf, (a_squared2 / 2 - a1 * a1) / a
    return ContactShape(
        c, rf, rf1, rf2, rf_squared, rf_squared1, rf_squared2, a, a1, a2, a_squared, a_squared1, a_squared2
    )
