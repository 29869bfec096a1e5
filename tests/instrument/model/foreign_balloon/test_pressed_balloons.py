"""Tests that the tables of pressed and free balloons are complete and physically sound."""

from collections import defaultdict
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from tests.instrument.model.foreign_balloon.cases import (
    BASELINES_KPA,
    FORCES_N,
    FREE_PRESSURES_KPA,
    LAWS,
    cases,
)
from tests.instrument.model.foreign_balloon.summary import FREE, MEMBRANE_RISES_KPA, PRESSED, rises_kpa, table

AMBIENT_KPA, CIRCUIT_MM3 = 101.325, 12_680.0
#: Radii of the surfaces of the balloon at rest in mm.
INNER_MM, OUTER_MM = 7.403, 7.603
#: Allowed ratio of the force to ΔP_f π a², over the force in N. The ratio exceeds 1 because the wall resists
#: bending, so that the edge of the contact carries a part of the force.
FORCE_BALANCE = {0.2: (1.0, 1.12), 1.0: (1.0, 1.095), 2.0: (1.0, 1.085), 3.5: (1.0, 1.08)}

ROWS = table(PRESSED)
FREE_ROWS = table(FREE)


@pytest.fixture(scope="module")
def paths():
    """Return the rows of each case, in the order of the table."""
    found = defaultdict(list)
    for row in ROWS:
        found[row["case"]].append(row)
    return found


def test_each_case_has_each_force(paths):
    expected = {case.name: list(FORCES_N) for law in LAWS for case in cases(law)}
    assert {name: [row["force_n"] for row in rows] for name, rows in paths.items()} == expected


def test_the_name_of_a_case_states_its_conditions(paths):
    for law in LAWS:
        for case in cases(law):
            for row in paths[case.name]:
                assert (row["law"], row["baseline_kpa"], row["sides"]) == (law, case.baseline_kpa, case.sides)
                assert (row["friction"], row["gas_exponent"]) == (case.friction, case.gas_exponent)


def test_pressure_contact_and_indentation_increase_with_the_force(paths):
    for rows in paths.values():
        assert rows[0]["final_kpa"] > rows[0]["baseline_kpa"]
        for name in ("final_kpa", "contact_radius_mm", "indentation_mm"):
            assert all(low[name] < high[name] for low, high in pairwise(rows))


@pytest.mark.parametrize("force_n", FORCE_BALANCE)
def test_the_pressure_on_the_flat_contact_carries_the_force(force_n):
    low, high = FORCE_BALANCE[force_n]
    for row in ROWS:
        if row["force_n"] == force_n:
            pressure_force_n = row["final_kpa"] * np.pi * row["contact_radius_mm"] ** 2 / 1000
            assert low < force_n / pressure_force_n < high


def test_the_locked_gas_follows_its_law(paths):
    free = {(row["law"], row["pressure_kpa"]): row["radius_mm"] for row in FREE_ROWS}
    for rows in paths.values():
        exponent = rows[0]["gas_exponent"]
        products = [
            (AMBIENT_KPA + row["final_kpa"]) * (CIRCUIT_MM3 + row["balloon_mm3"]) ** exponent for row in rows
        ]
        assert products == pytest.approx([products[0]] * len(rows), rel=1e-5)
        law, baseline_kpa = rows[0]["law"], rows[0]["baseline_kpa"]
        if (law, baseline_kpa) in free:
            balloon_mm3 = 4 / 3 * np.pi * inner_radius_mm(free[law, baseline_kpa]) ** 3
            product = (AMBIENT_KPA + baseline_kpa) * (CIRCUIT_MM3 + balloon_mm3) ** exponent
            assert products[0] == pytest.approx(product, rel=1e-4)


def test_friction_reduces_the_rise():
    rises = rises_kpa(ROWS)
    for key, rise in rises.items():
        for other, other_rise in rises.items():
            if key[:-1] == other[:-1] and key[-1] < other[-1]:
                assert all(rise[force_n] > other_rise[force_n] for force_n in FORCES_N)


def test_two_plates_raise_the_pressure_more_than_one():
    rises = rises_kpa(ROWS)
    for (law, baseline_kpa, sides, *rest), rise in rises.items():
        if sides == 1:
            both = rises[(law, baseline_kpa, 2.0, *rest)]
            assert all(both[force_n] > rise[force_n] for force_n in FORCES_N)


def test_the_rises_agree_with_a_thin_membrane():
    rises = rises_kpa(ROWS)
    for (baseline_kpa, friction), membrane in MEMBRANE_RISES_KPA.items():
        solid = rises["mooney-rivlin", baseline_kpa, 1.0, 1.0, friction]
        assert {force_n: solid[force_n] for force_n in membrane} == pytest.approx(membrane, rel=0.025)


def test_each_law_has_free_radii_up_to_the_highest_baseline():
    assert max(FREE_PRESSURES_KPA) > max(BASELINES_KPA)
    found = defaultdict(list)
    for row in FREE_ROWS:
        found[row["law"]].append(row["pressure_kpa"])
    assert found == {law: list(FREE_PRESSURES_KPA) for law in LAWS}


def test_all_laws_have_one_free_radius_at_8_kpa():
    radii_mm = [row["mid_radius_mm"] for row in FREE_ROWS if row["pressure_kpa"] == 8.0]
    assert radii_mm == pytest.approx([radii_mm[0]] * len(LAWS), abs=1e-4)


def inner_radius_mm(outer_radius_mm):
    """Return the inner radius that belongs to an outer radius, because rubber keeps its volume."""
    return (outer_radius_mm**3 - OUTER_MM**3 + INNER_MM**3) ** (1 / 3)


def exact_pressure_kpa(slope_of_energy, outer_radius_mm):
    """Return ∫ W'(λ)/(λ³ − 1) dλ, the pressure in a thick shell (Ogden, Non-linear Elastic Deformations)."""
    stretches = outer_radius_mm / OUTER_MM, inner_radius_mm(outer_radius_mm) / INNER_MM
    return quad(lambda stretch: slope_of_energy(stretch) / (stretch**3 - 1), *stretches)[0]


def mooney_rivlin(x):
    return 131.511 * 4 * (x - x**-5) + 51.167 * 4 * (x**3 - x**-3)


def gent(x):
    return 4 * (x - x**-5) / (1 - (2 * x**2 + x**-4 - 3) / 30)


def ogden(x):
    terms = zip((6.3, 0.012, -0.1), (1.3, 5.0, -2.0), strict=True)
    return sum(2 * mu * (x ** (a - 1) - x ** (-2 * a - 1)) for mu, a in terms)


@pytest.mark.parametrize(
    ("law", "slope"), [("mooney-rivlin", mooney_rivlin), ("gent", gent), ("ogden", ogden)], ids=LAWS
)
def test_the_free_radii_agree_with_the_exact_solution(law, slope):
    """The moduli of two laws are scaled to a radius at 8 kPa, so only the shape of their curve is tested."""
    rows = [row for row in FREE_ROWS if row["law"] == law and row["pressure_kpa"] > 0]
    exact_kpa = np.array([exact_pressure_kpa(slope, row["radius_mm"]) for row in rows])
    pressures_kpa = np.array([row["pressure_kpa"] for row in rows])
    scale = 1.0 if law == "mooney-rivlin" else 8.0 / exact_kpa[pressures_kpa == 8.0]
    assert scale * exact_kpa == pytest.approx(pressures_kpa, rel=3e-4)
