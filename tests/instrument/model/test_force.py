"""The force model against the paper, against geometry, and against its own traps."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from instrument.model import METHODS, Balloon, Circuit, Law, contact, estimate
from instrument.model.methods import bending_force, stretching_force
from instrument.model.pressed import Pressed, shape

BALLOON, CIRCUIT = Balloon(), Circuit()
PRESSURES = np.linspace(4.95, 11.45, 40)[:, None]
RISES = np.linspace(0.5, 3.0, 26)
each_method = pytest.mark.parametrize("method", METHODS)
each_pressure = pytest.mark.parametrize("initial_kpa", [4.95, 7.0, 8.85, 8.86, 11.45])


def pressed_between(initial_kpa, final_kpa):
    small_strain = 1.0 if initial_kpa > BALLOON.switch_kpa else 0.0
    return Pressed.between(initial_kpa, final_kpa, small_strain, BALLOON, CIRCUIT)


def relative(method, pressures, rises=RISES):
    reference = contact(pressures, pressures + rises, BALLOON, CIRCUIT)
    other = contact(pressures, pressures + rises, BALLOON, CIRCUIT, Law(method=method))
    return other.force_n / reference.force_n - 1


def test_the_free_radius_is_the_papers_quadratic():
    assert BALLOON.radius_mm(0.0) == 7.503
    assert BALLOON.radius_mm(10.0) == pytest.approx(7.503 + 0.59695 + 0.44652)


@each_pressure
@pytest.mark.parametrize("rise_kpa", [0.5, 2.0, 8.0])
def test_the_gas_fills_a_sphere_cut_by_two_planes(initial_kpa, rise_kpa):
    pressed = pressed_between(initial_kpa, initial_kpa + rise_kpa)
    d = contact(initial_kpa, initial_kpa + rise_kpa, BALLOON, CIRCUIT).indentation_mm
    s = shape(d, pressed)
    volume, _ = quad(lambda z: math.pi * (s.rf**2 - z * z), -s.gap, s.gap)
    ratio = (CIRCUIT.ambient_kpa + initial_kpa) / (CIRCUIT.ambient_kpa + initial_kpa + rise_kpa)
    before = CIRCUIT.volume_mm3 + 4 / 3 * math.pi * pressed.radius_mm**3
    assert CIRCUIT.volume_mm3 + volume == pytest.approx(before * ratio, rel=1e-12)


def stretching_energy(d, pressed):
    """Equations (4) and (5) as printed."""
    s, R = shape(d, pressed), pressed.radius_mm
    factor = 4 * pressed.young_kpa * pressed.thickness_mm * math.pi / (1 - pressed.poisson)
    if pressed.small_strain:
        return factor * (s.rf - R) ** 2
    chord = math.sqrt(2 * R * d)
    return factor * (((s.rf - R) / R) ** 2 * (R * R - R * d) + ((s.a - chord) / chord) ** 2 * R * d)


def bending_energy(d, pressed):
    s = shape(d, pressed)
    return pressed.young_kpa * pressed.thickness_mm**2 * math.pi / 12 * s.a**3 / s.rf**2


@each_pressure
@pytest.mark.parametrize("d", [1.5, 3.0, 6.0])
@pytest.mark.parametrize(
    ("energy", "force"),
    [
        (stretching_energy, lambda d, p: stretching_force(d, p, shape(d, p))),
        (bending_energy, lambda d, p: bending_force(p, shape(d, p))),
    ],
    ids=["stretching", "bending"],
)
def test_a_force_is_the_derivative_of_its_energy_by_the_approach_of_the_planes(initial_kpa, d, energy, force):
    pressed, h = pressed_between(initial_kpa, initial_kpa + 2.0), 1e-4
    slope = (energy(d + h, pressed) - energy(d - h, pressed)) / (2 * h) / 2
    curvature = (energy(d + h, pressed) - 2 * energy(d, pressed) + energy(d - h, pressed)) / h**2 / 2
    assert force(d, pressed)[0] == pytest.approx(slope, rel=1e-6)
    assert force(d, pressed)[1] == pytest.approx(curvature, rel=1e-3)


@each_method
def test_floats_and_arrays_agree(method):
    arrays = contact(PRESSURES, PRESSURES + RISES, BALLOON, CIRCUIT, Law(method=method))
    for i, j in ((0, 0), (13, 5), (25, 12), (39, 25)):
        initial, rise = float(PRESSURES[i, 0]), float(RISES[j])
        floats = contact(initial, initial + rise, BALLOON, CIRCUIT, Law(method=method))
        assert floats == pytest.approx([values[i, j] for values in arrays], rel=1e-9)


@each_method
def test_the_force_exists_and_grows_with_the_pressure_over_the_whole_range(method):
    rises = np.geomspace(1e-3, 16, 200)
    force = contact(PRESSURES, PRESSURES + rises, BALLOON, CIRCUIT, Law(method=method)).force_n
    assert np.all(np.isfinite(force))
    assert np.all(np.diff(force, axis=1) > 0)


def test_the_physical_root_is_taken_and_not_the_one_where_the_planes_only_touch():
    solved = contact(PRESSURES, PRESSURES + np.geomspace(1e-3, 16, 100), BALLOON, CIRCUIT)
    assert np.all(solved.force_n > 0.3)
    assert np.all(solved.contact_radius_mm > 1.0)


@pytest.mark.parametrize(("initial_kpa", "offset_n"), [(4.95, 0.42), (11.45, 1.83)])
def test_the_bare_law_does_not_go_to_zero_with_the_rise(initial_kpa, offset_n):
    assert contact(initial_kpa, initial_kpa + 0.001, BALLOON, CIRCUIT).force_n == pytest.approx(
        offset_n, abs=0.01
    )


def test_bending_carries_half_a_percent_to_two_and_a_half_and_most_in_a_soft_balloon():
    shares = {}
    for initial in (4.95, 8.0, 11.45):
        for rise in (1.0, 3.0):
            pressed = pressed_between(initial, initial + rise)
            d = contact(initial, initial + rise, BALLOON, CIRCUIT).indentation_mm
            s = shape(d, pressed)
            shares[initial, rise] = bending_force(pressed, s)[0] / stretching_force(d, pressed, s)[0]
    assert 0.003 < min(shares.values()) < 0.006
    assert 0.02 < max(shares.values()) < 0.027
    assert max(shares, key=shares.get) == (4.95, 1.0)


def test_above_the_switch_the_older_methods_lie_on_both_sides_of_the_energetic_one():
    stiff = np.linspace(8.86, 11.45, 40)[:, None]
    assert np.mean(relative("lulevich", stiff)) == pytest.approx(0.125, abs=0.01)
    assert np.mean(relative("shanahan", stiff)) == pytest.approx(-0.136, abs=0.01)


def test_in_a_soft_balloon_the_older_methods_lie_far_below_and_shanahan_furthest():
    soft = np.linspace(4.95, 7.0, 40)[:, None]
    lulevich, shanahan = relative("lulevich", soft), relative("shanahan", soft)
    assert np.mean(lulevich) == pytest.approx(-0.26, abs=0.01)
    assert np.mean(shanahan) == pytest.approx(-0.37, abs=0.01)
    assert lulevich.min() == pytest.approx(-0.39, abs=0.01)
    assert shanahan.min() == pytest.approx(-0.46, abs=0.01)


@pytest.mark.parametrize("rise_kpa", [0.5, 1.0, 3.0])
def test_the_force_drops_by_a_fifth_where_the_stretching_energy_is_switched(rise_kpa):
    below = contact(8.85, 8.85 + rise_kpa, BALLOON, CIRCUIT).force_n
    above = contact(8.8501, 8.8501 + rise_kpa, BALLOON, CIRCUIT).force_n
    assert -0.23 < above / below - 1 < -0.165


def test_the_volume_shrinks_as_the_paper_reports_above_the_switch():
    shares = []
    for initial in (8.86, 11.45):
        for rise in (0.5, 3.0):
            pressed = pressed_between(initial, initial + rise)
            whole = 4 / 3 * math.pi * pressed.radius_mm**3
            shares.append(
                rise / (CIRCUIT.ambient_kpa + initial + rise) * (CIRCUIT.volume_mm3 + whole) / whole
            )
    assert 0.015 < min(shares) < 0.025
    assert 0.14 < max(shares) < 0.18


@each_pressure
def test_below_half_a_kilopascal_the_force_is_a_straight_line_to_zero(initial_kpa):
    end = contact(initial_kpa, initial_kpa + 0.5, BALLOON, CIRCUIT)
    for share in (0.1, 0.5, 0.9):
        on_line = estimate(initial_kpa, initial_kpa + 0.5 * share, BALLOON, CIRCUIT)
        assert on_line.force_n == pytest.approx(share * end.force_n)
        assert on_line.indentation_mm == pytest.approx(share * end.indentation_mm)
        final = initial_kpa + 0.5 * share
        assert 1e-3 * math.pi * final * on_line.contact_radius_mm**2 == pytest.approx(on_line.force_n)
    assert estimate(initial_kpa, initial_kpa + 0.5, BALLOON, CIRCUIT) == pytest.approx(end)


def test_the_line_on_arrays_is_the_line_on_floats():
    rises = np.array([0.1, 0.49, 0.5, 2.0])
    arrays = estimate(8.0, 8.0 + rises, BALLOON, CIRCUIT)
    for j, rise in enumerate(rises):
        floats = estimate(8.0, 8.0 + float(rise), BALLOON, CIRCUIT)
        assert floats == pytest.approx([values[j] for values in arrays])


@each_method
@pytest.mark.parametrize(
    ("initial_kpa", "final_kpa"),
    [(math.nan, 9.0), (8.0, math.nan), (8.0, math.inf), (-math.inf, 5.0), (-5.0, -4.0), (1.0, 49.0)],
)
def test_what_has_no_solution_is_not_a_number_and_never_an_exception(method, initial_kpa, final_kpa):
    floats = contact(initial_kpa, final_kpa, BALLOON, CIRCUIT, Law(method=method))
    assert not isinstance(floats.force_n, complex)
    arrays = contact(
        np.array([initial_kpa, 8.0]), np.array([final_kpa, 9.0]), BALLOON, CIRCUIT, Law(method=method)
    )
    assert np.isnan(floats.force_n) == np.isnan(arrays.force_n[0])
    assert np.isfinite(arrays.force_n[1])


def test_no_gas_left_for_the_balloon_means_no_force():
    assert math.isnan(contact(8.0, 45.0, BALLOON, CIRCUIT).force_n)
