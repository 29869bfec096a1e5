"""Tests of the energies of a contact, equations (4) to (7) of the paper."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from pneuforce.instrument.model import Balloon, Circuit, ForceLaw, solve_contact
from pneuforce.instrument.model.contact_geometry import ContactGeometry, contact_shape
from pneuforce.instrument.model.energies import bending_energy_mj, contact_energies, stretching_energy_mj
from pneuforce.instrument.model.methods import bending_force, stretching_force

BALLOON, CIRCUIT = Balloon(), Circuit()
LAWS = [ForceLaw(), ForceLaw(switch="blend")]
PRESSURES_KPA, RISES_KPA = np.linspace(4.95, 11.45, 27), np.linspace(0.5, 3.0, 6)
each_law = pytest.mark.parametrize("law", LAWS, ids=["paper", "blend"])
each_pressure = pytest.mark.parametrize("baseline_kpa", [4.95, 8.5, 9.2, 11.45])


def energies(baseline_kpa, rise_kpa, law=LAWS[0]):
    return contact_energies(baseline_kpa, baseline_kpa + rise_kpa, BALLOON, CIRCUIT, law)


@each_law
@each_pressure
@pytest.mark.parametrize(
    ("energy_mj", "force"),
    [
        (stretching_energy_mj, lambda d, geometry, s: stretching_force(d, geometry, s)),
        (bending_energy_mj, lambda _, geometry, s: bending_force(geometry, s)),
    ],
    ids=["stretching", "bending"],
)
def test_equation_8_gives_the_force_as_the_derivative_of_the_energy(baseline_kpa, law, energy_mj, force):
    weight = law.small_strain_weight(baseline_kpa, BALLOON)
    geometry = ContactGeometry.between(baseline_kpa, baseline_kpa + 2.0, weight, BALLOON, CIRCUIT)
    d, h = solve_contact(baseline_kpa, baseline_kpa + 2.0, BALLOON, CIRCUIT, law).indentation_mm, 1e-4
    slope_n = (energy_mj(d + h, geometry) - energy_mj(d - h, geometry)) / (2 * h) / 2
    force_mn, _ = force(d, geometry, contact_shape(d, geometry))
    assert slope_n == pytest.approx(force_mn * 1e-3, rel=1e-6)


@each_pressure
def test_the_compression_energy_is_the_integral_of_the_pressure_over_the_volume(baseline_kpa):
    radius_mm, before_kpa = BALLOON.radius_mm(baseline_kpa), CIRCUIT.ambient_kpa + baseline_kpa
    before_mm3 = CIRCUIT.volume_mm3 + 4 / 3 * math.pi * radius_mm**3
    after_mm3 = before_mm3 * before_kpa / (before_kpa + 2.0)
    work, _ = quad(lambda mm3: before_kpa * before_mm3 / mm3 - CIRCUIT.ambient_kpa, after_mm3, before_mm3)
    assert energies(baseline_kpa, 2.0).compression_energy_mj == pytest.approx(1e-3 * work, rel=1e-6)


def test_bending_is_2_to_11_percent_of_stretching_and_largest_in_the_softest_balloon():
    """The paper calls the bending energy of a thin membrane negligible, except near the edge."""
    shares = {}
    for baseline_kpa in PRESSURES_KPA:
        for rise_kpa in RISES_KPA:
            stretching_mj, bending_mj, _ = energies(baseline_kpa, rise_kpa)
            shares[baseline_kpa, rise_kpa] = bending_mj / stretching_mj
    assert 0.02 < min(shares.values()) < 0.025
    assert 0.10 < max(shares.values()) < 0.115
    assert max(shares, key=shares.get) == (PRESSURES_KPA[0], RISES_KPA[0])


def test_the_compression_energy_is_0_3_to_4_times_the_stretching_energy():
    """The paper says that compression has negligible values. This is true of its force, not of its energy."""
    ratios = []
    for baseline_kpa in PRESSURES_KPA:
        for rise_kpa in RISES_KPA:
            stretching_mj, _, compression_mj = energies(baseline_kpa, rise_kpa)
            ratios.append(compression_mj / stretching_mj)
    assert 0.3 < min(ratios) < 0.4
    assert 3.0 < max(ratios) < 4.0


@pytest.mark.parametrize(
    ("baseline_kpa", "rise_kpa", "law"),
    [
        (8.0, 2.0, ForceLaw(method="lulevich")),
        (8.0, 2.0, ForceLaw(method="shanahan")),
        (8.0, 2.0, ForceLaw(method="membrane")),
        (8.0, 0.49, ForceLaw()),
        (8.0, 41.0, ForceLaw()),
        (math.nan, 2.0, ForceLaw()),
    ],
)
def test_a_contact_that_does_not_solve_the_equations_has_no_energies(baseline_kpa, rise_kpa, law):
    assert all(map(math.isnan, energies(baseline_kpa, rise_kpa, law)))
