"""Tests of the force model: results of the paper, geometry, and choice of the physical root."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from pneuforce.instrument.model import METHODS, Balloon, Circuit, ForceLaw, estimate, solve_contact
from pneuforce.instrument.model.contact_geometry import ContactGeometry, contact_shape
from pneuforce.instrument.model.methods import bending_force, stretching_force

BALLOON, CIRCUIT = Balloon(), Circuit()
PRESSURES = np.linspace(4.95, 11.45, 40)[:, None]
RISES = np.linspace(0.5, 3.0, 26)
each_method = pytest.mark.parametrize("method", METHODS)
each_pressure = pytest.mark.parametrize("baseline_kpa", [4.95, 7.0, 8.85, 8.86, 11.45])


def geometry_between(baseline_kpa, final_kpa):
    weight = 1.0 if baseline_kpa > BALLOON.switch_kpa else 0.0
    return ContactGeometry.between(baseline_kpa, final_kpa, weight, BALLOON, CIRCUIT)


def difference_to_energetic(method, pressures, rises=RISES):
    reference = solve_contact(pressures, pressures + rises, BALLOON, CIRCUIT)
    other = solve_contact(pressures, pressures + rises, BALLOON, CIRCUIT, ForceLaw(method=method))
    return other.force_n / reference.force_n - 1


def test_the_free_radius_is_the_quadratic_of_the_paper():
    assert BALLOON.radius_mm(0.0) == 7.503
    assert BALLOON.radius_mm(10.0) == pytest.approx(7.503 + 0.59695 + 0.44652)


@each_pressure
@pytest.mark.parametrize("rise_kpa", [0.5, 2.0, 8.0])
def test_the_gas_fills_a_sphere_cut_by_two_planes(baseline_kpa, rise_kpa):
    geometry = geometry_between(baseline_kpa, baseline_kpa + rise_kpa)
    d = solve_contact(baseline_kpa, baseline_kpa + rise_kpa, BALLOON, CIRCUIT).indentation_mm
    s = contact_shape(d, geometry)
    volume, _ = quad(lambda z: math.pi * (s.rf**2 - z * z), -s.gap, s.gap)
    ratio = (CIRCUIT.ambient_kpa + baseline_kpa) / (CIRCUIT.ambient_kpa + baseline_kpa + rise_kpa)
    before = CIRCUIT.volume_mm3 + 4 / 3 * math.pi * geometry.radius_mm**3
    assert CIRCUIT.volume_mm3 + volume == pytest.approx(before * ratio, rel=1e-12)


def stretching_energy(d, geometry):
    """Return E_str by equation (4) or (5), as printed in the paper."""
    s, R = contact_shape(d, geometry), geometry.radius_mm
    factor = 4 * geometry.young_kpa * geometry.thickness_mm * math.pi / (1 - geometry.poisson)
    if geometry.small_strain_weight:
        return factor * (s.rf - R) ** 2
    chord = math.sqrt(2 * R * d)
    return factor * (((s.rf - R) / R) ** 2 * (R * R - R * d) + ((s.a - chord) / chord) ** 2 * R * d)


def bending_energy(d, geometry):
    """Return E_bend = (E h² π/12) a³/R_f²."""
    s = contact_shape(d, geometry)
    return geometry.young_kpa * geometry.thickness_mm**2 * math.pi / 12 * s.a**3 / s.rf**2


@each_pressure
@pytest.mark.parametrize("d", [1.5, 3.0, 6.0])
@pytest.mark.parametrize(
    ("energy", "force"),
    [
        (stretching_energy, lambda d, p: stretching_force(d, p, contact_shape(d, p))),
        (bending_energy, lambda d, p: bending_force(p, contact_shape(d, p))),
    ],
    ids=["stretching", "bending"],
)
def test_a_force_is_the_derivative_of_its_energy_by_the_approach_of_the_planes(
    baseline_kpa, d, energy, force
):
    geometry, h = geometry_between(baseline_kpa, baseline_kpa + 2.0), 1e-4
    slope = (energy(d + h, geometry) - energy(d - h, geometry)) / (2 * h) / 2
    curvature = (energy(d + h, geometry) - 2 * energy(d, geometry) + energy(d - h, geometry)) / h**2 / 2
    assert force(d, geometry)[0] == pytest.approx(slope, rel=1e-6)
    assert force(d, geometry)[1] == pytest.approx(curvature, rel=1e-3)


@each_method
def test_floats_and_arrays_agree(method):
    arrays = solve_contact(PRESSURES, PRESSURES + RISES, BALLOON, CIRCUIT, ForceLaw(method=method))
    for i, j in ((0, 0), (13, 5), (25, 12), (39, 25)):
        initial, rise = float(PRESSURES[i, 0]), float(RISES[j])
        floats = solve_contact(initial, initial + rise, BALLOON, CIRCUIT, ForceLaw(method=method))
        assert floats == pytest.approx([values[i, j] for values in arrays], rel=1e-9)


@each_method
def test_the_force_exists_and_grows_with_the_pressure_over_the_whole_range(method):
    rises = np.geomspace(1e-3, 16, 200)
    force = solve_contact(PRESSURES, PRESSURES + rises, BALLOON, CIRCUIT, ForceLaw(method=method)).force_n
    assert np.all(np.isfinite(force))
    assert np.all(np.diff(force, axis=1) > 0)


def test_the_physical_root_is_taken_and_not_the_one_where_the_planes_only_touch():
    solved = solve_contact(PRESSURES, PRESSURES + np.geomspace(1e-3, 16, 100), BALLOON, CIRCUIT)
    assert np.all(solved.force_n > 0.3)
    assert np.all(solved.contact_radius_mm > 1.0)


@pytest.mark.parametrize(("baseline_kpa", "offset_n"), [(4.95, 0.42), (11.45, 1.83)])
def test_the_law_without_interpolation_does_not_go_to_zero_with_the_rise(baseline_kpa, offset_n):
    assert solve_contact(baseline_kpa, baseline_kpa + 0.001, BALLOON, CIRCUIT).force_n == pytest.approx(
        offset_n, abs=0.01
    )


def test_bending_is_0_4_to_2_5_percent_of_stretching_and_largest_at_low_pressure():
    shares = {}
    for initial in (4.95, 8.0, 11.45):
        for rise in (1.0, 3.0):
            geometry = geometry_between(initial, initial + rise)
            d = solve_contact(initial, initial + rise, BALLOON, CIRCUIT).indentation_mm
            s = contact_shape(d, geometry)
            shares[initial, rise] = bending_force(geometry, s)[0] / stretching_force(d, geometry, s)[0]
    assert 0.003 < min(shares.values()) < 0.006
    assert 0.02 < max(shares.values()) < 0.027
    assert max(shares, key=shares.get) == (4.95, 1.0)


def test_above_the_switch_lulevich_is_above_and_shanahan_below_the_energetic_method():
    stiff = np.linspace(8.86, 11.45, 40)[:, None]
    assert np.mean(difference_to_energetic("lulevich", stiff)) == pytest.approx(0.125, abs=0.01)
    assert np.mean(difference_to_energetic("shanahan", stiff)) == pytest.approx(-0.136, abs=0.01)


def test_at_low_pressure_both_older_methods_are_far_below_and_shanahan_is_lowest():
    soft = np.linspace(4.95, 7.0, 40)[:, None]
    lulevich, shanahan = difference_to_energetic("lulevich", soft), difference_to_energetic("shanahan", soft)
    assert np.mean(lulevich) == pytest.approx(-0.26, abs=0.01)
    assert np.mean(shanahan) == pytest.approx(-0.37, abs=0.01)
    assert lulevich.min() == pytest.approx(-0.39, abs=0.01)
    assert shanahan.min() == pytest.approx(-0.46, abs=0.01)


@pytest.mark.parametrize("rise_kpa", [0.5, 1.0, 3.0])
def test_the_force_drops_by_a_fifth_at_the_switch_of_the_stretching_energy(rise_kpa):
    below = solve_contact(8.85, 8.85 + rise_kpa, BALLOON, CIRCUIT).force_n
    above = solve_contact(8.8501, 8.8501 + rise_kpa, BALLOON, CIRCUIT).force_n
    assert -0.23 < above / below - 1 < -0.165


def test_the_volume_shrinks_as_the_paper_reports_above_the_switch():
    shares = []
    for initial in (8.86, 11.45):
        for rise in (0.5, 3.0):
            geometry = geometry_between(initial, initial + rise)
            sphere_mm3 = 4 / 3 * math.pi * geometry.radius_mm**3
            shares.append(
                rise / (CIRCUIT.ambient_kpa + initial + rise) * (CIRCUIT.volume_mm3 + sphere_mm3) / sphere_mm3
            )
    assert 0.015 < min(shares) < 0.025
    assert 0.14 < max(shares) < 0.18


@each_pressure
def test_below_a_rise_of_0_5_kpa_the_force_is_a_straight_line_to_zero(baseline_kpa):
    end = solve_contact(baseline_kpa, baseline_kpa + 0.5, BALLOON, CIRCUIT)
    for share in (0.1, 0.5, 0.9):
        on_line = estimate(baseline_kpa, baseline_kpa + 0.5 * share, BALLOON, CIRCUIT)
        assert on_line.force_n == pytest.approx(share * end.force_n)
        assert on_line.indentation_mm == pytest.approx(share * end.indentation_mm)
        final = baseline_kpa + 0.5 * share
        assert 1e-3 * math.pi * final * on_line.contact_radius_mm**2 == pytest.approx(on_line.force_n)
    assert estimate(baseline_kpa, baseline_kpa + 0.5, BALLOON, CIRCUIT) == pytest.approx(end)


def test_the_interpolation_of_arrays_equals_that_of_floats():
    rises = np.array([0.1, 0.49, 0.5, 2.0])
    arrays = estimate(8.0, 8.0 + rises, BALLOON, CIRCUIT)
    for j, rise in enumerate(rises):
        floats = estimate(8.0, 8.0 + float(rise), BALLOON, CIRCUIT)
        assert floats == pytest.approx([values[j] for values in arrays])


@each_method
@pytest.mark.parametrize(
    ("baseline_kpa", "final_kpa"),
    [(math.nan, 9.0), (8.0, math.nan), (8.0, math.inf), (-math.inf, 5.0), (-5.0, -4.0), (1.0, 49.0)],
)
def test_inputs_without_a_solution_give_nan_and_no_exception(method, baseline_kpa, final_kpa):
    floats = solve_contact(baseline_kpa, final_kpa, BALLOON, CIRCUIT, ForceLaw(method=method))
    assert not isinstance(floats.force_n, complex)
    arrays = solve_contact(
        np.array([baseline_kpa, 8.0]), np.array([final_kpa, 9.0]), BALLOON, CIRCUIT, ForceLaw(method=method)
    )
    assert np.isnan(floats.force_n) == np.isnan(arrays.force_n[0])
    assert np.isfinite(arrays.force_n[1])


def test_there_is_no_force_without_gas_in_the_balloon():
    assert math.isnan(solve_contact(8.0, 45.0, BALLOON, CIRCUIT).force_n)
