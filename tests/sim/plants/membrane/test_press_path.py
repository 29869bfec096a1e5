"""Tests of presses against results of an independent solver, and against exact statements of mechanics."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid, simpson, trapezoid
from scipy.optimize import brentq

from pneuforce.sim.plants.membrane.free_half import free_half
from pneuforce.sim.plants.membrane.material import MOONEY_RIVLIN, RUBBERS, Skin
from pneuforce.sim.plants.membrane.paths import SMALL_CONTACTS, PressedBalloon, SealedCircuit, press_nodes
from pneuforce.sim.plants.membrane.press_path import free_radius_mm, limit_kpa, press_path
from pneuforce.sim.plants.membrane.shooting import EQUATOR, Point, frictionless_edge, integrate
from tests.sim.plants.membrane.identified import energy_kpa_mm, measured_radius_mm

PAPER = Skin(MOONEY_RIVLIN)
BASELINES_KPA = [5.0, 8.0, 11.0]
COARSE = np.concatenate([SMALL_CONTACTS, np.linspace(0.1, 0.6, 10)])
contacts = pytest.mark.parametrize("contact", ["slide", "stick"])
both_sides = pytest.mark.parametrize("sides", [1, 2])


@cache
def paper_path(contact, sides):
    return press_path(PressedBalloon(PAPER, sides, contact), BASELINES_KPA)


def rise_kpa(balloon):
    """Return the rise at 8 kPa and 1 N, computed in few steps."""
    return press_path(balloon, [8.0], COARSE).at([1.0]).final_kpa[0, 0] - 8.0


@pytest.mark.parametrize(
    ("column", "forces_n", "expected_kpa"),
    [(0, [0.5, 1], [0.537, 1.312]), (1, [0.5, 1, 2], [0.422, 0.980, 2.213])]
    + [(2, [0.5, 1, 2, 3], [0.387, 0.832, 1.740, 2.570])],
)
def test_a_sliding_balloon_agrees_with_another_solver(column, forces_n, expected_kpa):
    final_kpa = paper_path("slide", 1).at(forces_n).final_kpa[:, column]
    assert final_kpa - BASELINES_KPA[column] == pytest.approx(expected_kpa, abs=6e-4)


@pytest.mark.parametrize(("column", "force_n", "expected_kpa"), [(1, 1.0, 0.81), (2, 2.0, 1.43)])
def test_a_sticking_balloon_agrees_with_another_solver(column, force_n, expected_kpa):
    final_kpa = paper_path("stick", 1).at([force_n]).final_kpa[0, column]
    assert final_kpa - BASELINES_KPA[column] == pytest.approx(expected_kpa, abs=6e-3)


@contacts
@both_sides
def test_the_force_is_the_pressure_on_the_contact(contact, sides):
    path = paper_path(contact, sides)
    assert path.force_n == pytest.approx(1e-3 * path.final_kpa * np.pi * path.contact_radius_mm**2)
    assert path.force_n[0] == pytest.approx(0)
    assert path.final_kpa[0] == pytest.approx(BASELINES_KPA, abs=1e-6)


def half_of(balloon, node, column):
    """Return energy [kPa·mm³] and volume [mm³] of the free part of a pressed half."""
    skin = balloon.skin
    angles = node.angle * (EQUATOR / node.angle) ** np.linspace(0, 1, 61)
    if balloon.contact == "slide":
        edge = frictionless_edge(skin, node.stretch[[column]], np.asarray(node.angle))
    else:
        edge = Point(node.contact_radius_mm[[column]], node.stretch[[column]], np.zeros(1))
    points = integrate(skin, angles[:, None], edge, node.pressure_kpa[[column]])
    r, along, slope = (np.stack(values)[:, 0] for values in zip(*points, strict=True))
    radius = skin.material.radius_mm
    around = r / (radius * np.sin(angles))
    energy = skin.thickness(np.cos(angles)) * energy_kpa_mm(skin.material, along, around)
    depth_rate = radius * along * np.sin(slope)
    return (
        simpson(2 * np.pi * radius**2 * np.sin(angles) * energy, x=angles),
        simpson(np.pi * r**2 * depth_rate, x=angles),
    )


@pytest.mark.parametrize("unevenness", [0.0, -0.15])
def test_a_sticking_plate_does_work_on_gas_and_skin_only(unevenness):
    """For the pressed half, dE = F dd + ΔP dV, because friction does no work on points that do not move."""
    balloon = PressedBalloon(Skin(MOONEY_RIVLIN, unevenness), contact="stick")
    skin, stretch = balloon.skin, free_half(balloon.skin).stretch_at([8.0])
    nodes = list(press_nodes(balloon, stretch, np.linspace(0.01, 0.8, 40)))[1:-1]
    angle = np.array([node.angle for node in nodes])
    force, pressure, depth, radius, along = np.array(
        [
            (
                1e-3 * np.pi * node.pressure_kpa[0] * node.contact_radius_mm[0] ** 2,
                node.pressure_kpa[0],
                -node.half_height_mm[0],
                node.contact_radius_mm[0],
                node.stretch[0],
            )
            for node in nodes
        ]
    ).T
    free, volume = np.array([half_of(balloon, node, 0) for node in nodes]).T
    rest = skin.material.radius_mm * np.sin(angle)
    ring = skin.thickness(np.cos(angle)) * energy_kpa_mm(skin.material, along, radius / rest)
    on_plate = cumulative_trapezoid(2 * np.pi * skin.material.radius_mm * rest * ring, angle, initial=0)
    work, filled = 1e3 * trapezoid(force, depth), trapezoid(pressure, volume)
    energy = free + on_plate
    assert work > 2e3
    assert energy[-1] - energy[0] == pytest.approx(work + filled, abs=3e-3 * work)


@contacts
@both_sides
def test_the_gas_law_holds_on_each_path(contact, sides):
    circuit = SealedCircuit(tubes_mm3=8_000.0, ambient_kpa=97.0, gas_exponent=1.2)
    balloon = PressedBalloon(PAPER, sides, contact, circuit)
    stretch = MOONEY_RIVLIN.free_stretch(np.array([8.0]))
    free, *pressed = press_nodes(balloon, stretch, np.array([0.1, 0.2, 0.3, 0.4, 0.5]))
    before = (8.0 + 97.0) * (8_000.0 + 4 / 3 * np.pi * (7.503 * stretch[0]) ** 3) ** 1.2
    assert free.pressure_kpa == pytest.approx(8.0, abs=1e-5)
    for node in pressed[:-1]:
        half = half_of(balloon, node, 0)[1]
        kept = 2 / 3 * np.pi * (7.503 * MOONEY_RIVLIN.free_stretch(node.pressure_kpa[0])) ** 3
        volume = 8_000.0 + half + (half if sides == 2 else kept)
        assert (node.pressure_kpa[0] + 97.0) * volume**1.2 == pytest.approx(before, rel=5e-6)


@both_sides
def test_a_sticking_balloon_raises_the_pressure_less(sides):
    slide, stick = (paper_path(contact, sides).at([0.5, 1.0, 3.0]) for contact in ("slide", "stick"))
    assert (stick.final_kpa < slide.final_kpa).all()
    assert (stick.final_kpa > np.array(BASELINES_KPA)).all()


def test_less_gas_in_the_tubes_or_a_larger_gas_exponent_raises_the_pressure_more():
    usual = rise_kpa(PressedBalloon(PAPER, contact="stick"))
    for circuit in (SealedCircuit(tubes_mm3=4_000.0), SealedCircuit(gas_exponent=1.4)):
        assert rise_kpa(PressedBalloon(PAPER, contact="stick", circuit=circuit)) > 1.1 * usual


@pytest.mark.parametrize("sides", [1, 2])
def test_presses_with_different_gas_exponents_are_those_of_separate_computations(sides):
    exponents = np.array([1.0, 1.2, 1.1])
    together = press_path(
        PressedBalloon(PAPER, sides, "stick", SealedCircuit(gas_exponent=exponents)), [8.0, 8.0, 9.0], COARSE
    )
    for column, kpa in enumerate([8.0, 8.0, 9.0]):
        circuit = SealedCircuit(gas_exponent=float(exponents[column]))
        alone = press_path(PressedBalloon(PAPER, sides, "stick", circuit), [kpa], COARSE)
        assert together.final_kpa[:, column] == pytest.approx(alone.final_kpa[:, 0], nan_ok=True)


def test_a_thin_skin_of_twice_the_stiffness_is_the_same_skin():
    same = Skin(replace(MOONEY_RIVLIN, mu_kpa=2 * MOONEY_RIVLIN.mu_kpa, thickness_mm=0.1))
    one, other = (press_path(PressedBalloon(skin, 1, "stick"), [8.0], COARSE) for skin in (same, PAPER))
    assert one.final_kpa == pytest.approx(other.final_kpa)


def test_forces_outside_a_press_and_pressures_that_are_not_reached_give_nan():
    path = press_path(PressedBalloon(Skin(RUBBERS["gent"]), contact="stick"), [8.0, 14.0, -1.0], COARSE)
    assert np.isfinite(path.at([0.0, 1.0]).final_kpa[:, 0]).all()
    assert np.isnan(path.at([-1.0, 100.0]).final_kpa).all()
    assert np.isnan(path.final_kpa[:, 1:]).all()
    assert limit_kpa(Skin(RUBBERS["gent"])) == pytest.approx(13.426, abs=1e-3)


@pytest.mark.parametrize("name", RUBBERS)
def test_the_free_radius_is_that_of_the_rubber(name):
    rubber, pressures = RUBBERS[name], np.array([5.0, 8.0, 11.0])
    radius = free_radius_mm(Skin(rubber), pressures)
    assert radius == pytest.approx(7.503 * rubber.free_stretch(pressures), abs=1e-5)
    assert radius == pytest.approx(measured_radius_mm(pressures), abs=0.1)
    assert np.isnan(free_radius_mm(Skin(rubber), [-0.1, 30.0])).all()


@pytest.mark.parametrize("unevenness", [0.15, -0.15])
@pytest.mark.parametrize("pole", [1.05, 1.123])
def test_a_free_uneven_balloon_is_in_equilibrium(unevenness, pole):
    """On the equator, 2πr T1 = ΔP π r². A skin with a thin pole is elongated, as its equator is stiffer."""
    skin = Skin(MOONEY_RIVLIN, unevenness)
    free, angles = free_half(skin), np.linspace(0, EQUATOR, 121)[:, None]

    def equator(pressure_kpa):
        start = Point(np.zeros(1), np.array([pole]), np.zeros(1))
        return integrate(skin, angles, start, np.array([pressure_kpa]))[-1]

    close_kpa = free.pressure_at(pole)
    pressure_kpa = brentq(lambda p: equator(p).slope[0] - EQUATOR, close_kpa - 0.05, close_kpa + 0.05)
    r, along, _ = equator(pressure_kpa)
    tension = skin.thickness(0.0) * MOONEY_RIVLIN.tensions(along, r / MOONEY_RIVLIN.radius_mm).along
    assert 2 * tension == pytest.approx(pressure_kpa * r, rel=1e-5)
    assert close_kpa == pytest.approx(pressure_kpa, abs=5e-4)
    assert free.radius_at(pole) == pytest.approx(r[0], abs=1e-4)
    assert np.sign(free.radius_at(pole) - free.height_at(pole)) == np.sign(unevenness)


def test_a_slightly_uneven_balloon_is_nearly_even():
    skin = Skin(MOONEY_RIVLIN, 1e-6)
    uneven, even = (
        press_path(PressedBalloon(each, contact="stick"), BASELINES_KPA, COARSE).at([1.0])
        for each in (skin, PAPER)
    )
    assert uneven.final_kpa == pytest.approx(even.final_kpa, abs=2e-5)
    assert uneven.indentation_mm == pytest.approx(even.indentation_mm, abs=2e-5)


def test_at_the_same_baseline_a_thin_pole_gives_a_larger_rise_than_a_thick_pole():
    thin, even, thick = (
        rise_kpa(PressedBalloon(Skin(MOONEY_RIVLIN, e), contact="stick")) for e in (-0.15, 0.0, 0.15)
    )
    assert thin > even + 0.005 > thick + 0.01
