"""Tests of presses: known rises of the paper's balloon, the force balance and the gas law."""

import numpy as np
import pytest

from pneuforce.instrument.model.membrane.press import PressConditions, press
from pneuforce.instrument.model.rubber import RubberSkin

#: Mooney–Rivlin skin that follows the radius curve of the paper best (docs/simulator.md).
C1_KPA_MM, C2_KPA_MM = 131.511 * 0.2, 51.167 * 0.2
#: Cases: ΔP_i, skin sticks, pressed sides, gas exponent.
CASES = [
    (5.0, False, 1, 1.0),
    (8.0, False, 1, 1.0),
    (11.0, False, 1, 1.0),
    (8.0, True, 1, 1.0),
    (11.0, True, 1, 1.0),
    (8.0, False, 2, 1.0),
    (8.0, False, 1, 1.2),
]
TUBES_MM3, AMBIENT_KPA = 12_680.0, 101.325


@pytest.fixture(scope="module")
def paths():
    """Return the paths of all cases, computed together."""
    baseline, sticks, sides, polytropic = (np.array(values) for values in zip(*CASES, strict=True))
    ones = np.ones(len(CASES))
    skin = RubberSkin(7.503 * ones, C1_KPA_MM * ones, C2_KPA_MM * ones)
    conditions = PressConditions(
        skin, baseline, sticks, sides, TUBES_MM3 * ones, AMBIENT_KPA * ones, polytropic
    )
    return press(conditions)


def rise_kpa(paths, case, force_n):
    column = CASES.index(case)
    known = np.isfinite(paths.force_n[:, column])
    return np.interp(force_n, paths.force_n[known, column], paths.final_kpa[known, column]) - case[0]


@pytest.mark.parametrize(
    ("case", "forces_n", "rises_kpa"),
    [
        (CASES[0], (0.5, 1.0), (0.537, 1.312)),
        (CASES[1], (0.5, 1.0, 2.0), (0.422, 0.980, 2.213)),
        (CASES[2], (0.5, 1.0, 2.0, 3.0), (0.387, 0.832, 1.740, 2.570)),
        (CASES[3], (1.0,), (0.805,)),
        (CASES[4], (2.0,), (1.42,)),
    ],
)
def test_the_rises_are_those_of_an_independent_solver(paths, case, forces_n, rises_kpa):
    """The values are those of the shooting method of the simulator and of a second program."""
    assert [rise_kpa(paths, case, f) for f in forces_n] == pytest.approx(list(rises_kpa), rel=0.01)


def test_a_skin_that_sticks_needs_less_rise(paths):
    for force_n in (0.5, 1.0, 2.0):
        ratio = rise_kpa(paths, CASES[3], force_n) / rise_kpa(paths, CASES[1], force_n)
        assert 0.78 < ratio < 0.87


def test_a_press_on_two_sides_displaces_twice_the_gas(paths):
    assert rise_kpa(paths, CASES[5], 1.0) / rise_kpa(paths, CASES[1], 1.0) == pytest.approx(2.0, abs=0.1)


def test_a_larger_gas_exponent_gives_a_larger_rise(paths):
    assert 1.0 < rise_kpa(paths, CASES[6], 1.0) / rise_kpa(paths, CASES[1], 1.0) < 1.2


def test_the_force_is_the_pressure_on_the_contact_area(paths):
    """The last node that touches carries no force: the edge lies between this node and the node before."""
    force_n = paths.force_n[20:70]
    inner = 1e-3 * np.pi * paths.final_kpa[20:70] * paths.contact_radius_mm[19:69] ** 2
    outer = 1e-3 * np.pi * paths.final_kpa[20:70] * paths.contact_radius_mm[20:70] ** 2
    assert (inner < force_n).all()
    assert (force_n < outer).all()


def test_each_press_grows_from_zero(paths):
    assert paths.force_n[0] == pytest.approx(0.0)
    assert paths.indentation_mm[0] == pytest.approx(0.0, abs=0.01)
    assert (np.diff(paths.force_n[:60], axis=0) > 0).all()
    assert (np.diff(paths.indentation_mm[:60], axis=0) > 0).all()


def test_a_finer_mesh_changes_the_rise_by_less_than_one_percent(paths):
    conditions = PressConditions(
        RubberSkin(*(np.full(2, value) for value in (7.503, C1_KPA_MM, C2_KPA_MM))),
        np.array([8.0, 8.0]), np.array([False, True]), np.array([1, 1]),
        np.full(2, TUBES_MM3), np.full(2, AMBIENT_KPA), np.ones(2),
    )  # fmt: skip
    finer = press(conditions, elements=200)
    for column, case in enumerate((CASES[1], CASES[3])):
        rise = np.interp(1.0, finer.force_n[:, column], finer.final_kpa[:, column]) - 8.0
        assert rise == pytest.approx(rise_kpa(paths, case, 1.0), rel=0.01)


def test_a_balloon_beyond_its_limit_point_has_no_solution():
    one = np.ones(1)
    skin = RubberSkin(7.5 * one, 30.0 * one, 0.0 * one)
    path = press(
        PressConditions(skin, 11.4 * one, one < 0, np.ones(1, int), TUBES_MM3 * one, AMBIENT_KPA * one, one),
        elements=30,
    )
    assert np.isnan(path.force_n).all()
