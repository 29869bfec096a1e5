"""Energies of a contact by equations (4) to (7) of the paper. 1 kPa·mm³ is 1 µJ."""

from __future__ import annotations

import math
from typing import NamedTuple

from pneuforce.instrument.model.balloon import MIN_RISE_KPA, Balloon, Circuit, sphere_volume_mm3
from pneuforce.instrument.model.contact_geometry import ContactGeometry, contact_shape
from pneuforce.instrument.model.force import solve_contact
from pneuforce.instrument.model.law import ForceLaw

_MJ_PER_KPA_MM3 = 1e-3


class ContactEnergies(NamedTuple):
    """Energies that a contact stores [mJ]. They are NaN if the equations do not apply."""

    stretching_energy_mj: float = math.nan  #: of the membrane, (4) above ΔP_i = 8.85 kPa and (5) below
    bending_energy_mj: float = math.nan  #: of the membrane, (6)
    compression_energy_mj: float = math.nan  #: of the gas, (7)


def contact_energies(
    baseline_kpa: float, final_kpa: float, balloon: Balloon, circuit: Circuit, law: ForceLaw
) -> ContactEnergies:
    """Return the energies of the contact that raises the gauge pressure from ΔP_i to ΔP_f.

    The energies are NaN for a method without energies, if the law has no solution, and below a rise of
    0.5 kPa, because an interpolated contact does not solve the equations.
    """
    if law.method != "energetic" or not final_kpa - baseline_kpa >= MIN_RISE_KPA:
        return ContactEnergies()
    d = solve_contact(baseline_kpa, final_kpa, balloon, circuit, law).indentation_mm
    if not math.isfinite(d):
        return ContactEnergies()
    weight = law.small_strain_weight(baseline_kpa, balloon)
    geometry = ContactGeometry.between(baseline_kpa, final_kpa, weight, balloon, circuit)
    compression_mj = compression_energy_mj(baseline_kpa, final_kpa, balloon, circuit)
    return ContactEnergies(stretching_energy_mj(d, geometry), bending_energy_mj(d, geometry), compression_mj)


def stretching_energy_mj(indentation_mm: float, geometry: ContactGeometry) -> float:
    """Return the mean of (4) and (5), weighted by `small_strain_weight` [mJ]."""
    s, radius, weight = (
        contact_shape(indentation_mm, geometry),
        geometry.radius_mm,
        geometry.small_strain_weight,
    )
    caps_mm2, chord = radius * indentation_mm, math.sqrt(2 * radius * indentation_mm)
    strain, cap_strain = (s.rf - radius) / radius, (s.a - chord) / chord
    sphere = strain**2 * radius**2
    split = strain**2 * (radius**2 - caps_mm2) + cap_strain**2 * caps_mm2
    stiffness = 4 * math.pi * geometry.young_kpa * geometry.thickness_mm / (1 - geometry.poisson)
    return float(_MJ_PER_KPA_MM3 * stiffness * (weight * sphere + (1 - weight) * split))


def bending_energy_mj(indentation_mm: float, geometry: ContactGeometry) -> float:
    """Return (6) with ρ = h R_f/a: E_bend = (E h² π/12) a³/R_f² [mJ]."""
    s = contact_shape(indentation_mm, geometry)
    stiffness = math.pi / 12 * geometry.young_kpa * geometry.thickness_mm**2
    return float(_MJ_PER_KPA_MM3 * stiffness * s.a**3 / s.rf**2)


def compression_energy_mj(baseline_kpa: float, final_kpa: float, balloon: Balloon, circuit: Circuit) -> float:
    """Return (7), the increase of the free energy of the gas at a constant temperature [mJ]."""
    before_kpa, after_kpa = circuit.ambient_kpa + baseline_kpa, circuit.ambient_kpa + final_kpa
    before_mm3 = circuit.volume_mm3 + sphere_volume_mm3(balloon.radius_mm(baseline_kpa))
    after_mm3 = before_mm3 * before_kpa / after_kpa
    heat = before_kpa * before_mm3 * math.log(before_mm3 / after_mm3)
    return float(_MJ_PER_KPA_MM3 * (heat - circuit.ambient_kpa * (before_mm3 - after_mm3)))
