"""Tests of the radius fit: it finds the quadratic of the paper and rejects impossible points."""

import numpy as np
import pytest

from pneuforce.instrument.calibration.radius import fit_radius
from pneuforce.instrument.calibration.rubber import LIMIT_PRESSURE_RATIO, free_radius_mm
from pneuforce.instrument.model import Balloon
from tests.instrument.calibration.points import error_message, points, share_within

PRESSURES_KPA = np.linspace(2.0, 11.5, 22)
TRUTH = (Balloon().rest_radius_mm, Balloon().radius_linear_mm_per_kpa, Balloon().radius_quadratic_mm_per_kpa2)
PAPER_MM = Balloon().radius_mm(PRESSURES_KPA)


def noisy(seed, radii_mm=PAPER_MM, std_mm=0.03):
    return radii_mm + np.random.default_rng(seed).normal(0, std_mm, len(radii_mm))


def test_the_22_pressures_of_the_paper_give_the_quadratic_of_the_paper():
    fit = fit_radius(points(pressure_kpa=PRESSURES_KPA, diameter_mm=2 * PAPER_MM))
    assert fit.quadratic.coefficients == pytest.approx(TRUTH, rel=1e-6)
    assert fit.quadratic.std < 1e-6


def test_radii_and_diameters_give_the_same_fit():
    by_radius = fit_radius(points(pressure_kpa=PRESSURES_KPA, radius_mm=PAPER_MM))
    by_diameter = fit_radius(points(pressure_kpa=PRESSURES_KPA, diameter_mm=2 * PAPER_MM))
    assert by_radius.quadratic.coefficients == pytest.approx(by_diameter.quadratic.coefficients)


def test_coefficients_and_radii_lie_within_their_stated_uncertainty():
    fits = [fit_radius(points(pressure_kpa=PRESSURES_KPA, radius_mm=noisy(n))) for n in range(200)]
    for k in range(3):
        errors = [fit.quadratic.coefficients[k] - TRUTH[k] for fit in fits]
        assert 0.57 <= share_within(errors, [fit.quadratic.stds[k] for fit in fits]) <= 0.79
    errors = [fit.radius_mm(8.0) - Balloon().radius_mm(8.0) for fit in fits]
    assert 0.57 <= share_within(errors, [fit.std_mm(8.0) for fit in fits]) <= 0.79
    assert np.mean([fit.quadratic.std for fit in fits]) == pytest.approx(0.03, rel=0.05)


def test_the_limit_point_of_a_rubber_balloon_is_found_within_its_stated_uncertainty():
    truth_kpa = 12.94
    radii = free_radius_mm(PRESSURES_KPA, 7.503, truth_kpa / LIMIT_PRESSURE_RATIO)
    fits = [fit_radius(points(pressure_kpa=PRESSURES_KPA, radius_mm=noisy(n, radii))) for n in range(100)]
    errors = [fit.rubber.limit_kpa - truth_kpa for fit in fits]
    assert max(map(abs, errors)) < 0.3
    assert 0.54 <= share_within(errors, [fit.rubber.limit_std_kpa for fit in fits]) <= 0.82


def test_setpoints_near_the_limit_point_cause_a_warning():
    stiff = fit_radius(points(pressure_kpa=PRESSURES_KPA, radius_mm=free_radius_mm(PRESSURES_KPA, 7.5, 40.0)))
    soft = fit_radius(points(pressure_kpa=PRESSURES_KPA, radius_mm=free_radius_mm(PRESSURES_KPA, 7.5, 20.88)))
    assert stiff.rubber.limit_warning(12.0) == ""
    assert "12.94 ± " in soft.rubber.limit_warning(12.0)
    assert "below 11.65 kPa" in soft.rubber.limit_warning(12.0)
    assert soft.rubber.limit_warning(11.6) == ""


@pytest.mark.parametrize(
    ("column", "other", "factor", "cell"),
    [("radius_mm", "diameter_mm", 2, "15.2"), ("diameter_mm", "radius_mm", 1, "7.6")],
)
def test_diameters_in_place_of_radii_are_rejected_with_the_column_and_the_value(column, other, factor, cell):
    message = error_message(fit_radius, points(pressure_kpa=PRESSURES_KPA, **{column: factor * PAPER_MM}))
    assert f"{column} = {cell}" in message
    assert f"name the column {other}" in message


@pytest.mark.parametrize(("lowest_kpa", "too_large_mm"), [(2.0, 0.1), (3.0, 0.2), (5.0, 0.4)])
def test_a_radius_at_rest_that_is_extrapolated_far_causes_a_warning(lowest_kpa, too_large_mm):
    kpa = np.linspace(lowest_kpa, 11.0, 12)
    fit = fit_radius(points(pressure_kpa=kpa, radius_mm=free_radius_mm(kpa, 7.5, 20.88)))
    assert fit.quadratic.coefficients[0] - 7.5 == pytest.approx(too_large_mm, abs=0.05)
    assert bool(fit.extrapolation_warning) == (lowest_kpa > 2.5)
    assert fit.skin.rest_radius_mm == pytest.approx(7.5, abs=0.05)


def with_row(row, radius_mm):
    radii = PAPER_MM.copy()
    radii[row] = radius_mm
    return radii


@pytest.mark.parametrize(
    ("columns", "expected"),
    [
        ({"pressure_kpa": PRESSURES_KPA[:5], "radius_mm": PAPER_MM[:5]}, "5 points, and at least 6"),
        (
            {"pressure_kpa": PRESSURES_KPA, "radius_mm": with_row(9, 7.4)},
            "mine.csv, line 11: the radius 7.400",
        ),
        ({"pressure_kpa": PRESSURES_KPA, "radius_mm": PAPER_MM[::-1]}, "smaller than"),
        ({"pressure_kpa": PRESSURES_KPA, "radius_mm": PAPER_MM / 10}, "looks like cm"),
        ({"pressure_kpa": PRESSURES_KPA, "radius_mm": PAPER_MM / 1000}, "looks like m:"),
        ({"pressure_kpa": PRESSURES_KPA, "radius_mm": PAPER_MM * 1000}, "looks like µm"),
        ({"pressure_kpa": PRESSURES_KPA * 1000, "radius_mm": PAPER_MM}, "look like Pa"),
        ({"pressure_kpa": PRESSURES_KPA * 10, "radius_mm": PAPER_MM}, "look like hPa"),
        ({"pressure_kpa": PRESSURES_KPA / 100, "radius_mm": PAPER_MM}, "look like bar"),
        ({"pressure_kpa": PRESSURES_KPA - 3, "radius_mm": PAPER_MM}, "line 2: pressure_kpa is below 0"),
        ({"pressure_kpa": 8 + PRESSURES_KPA / 10, "radius_mm": PAPER_MM}, "the pressures span 0.95 kPa"),
        (
            {"pressure_kpa": [4, 4, 4, 8, 8, 8], "radius_mm": [7.8, 7.8, 7.8, 8.2, 8.2, 8.2]},
            "3 different pressures",
        ),
        ({"pressure_kpa": PRESSURES_KPA, "radius_mm": np.full(22, 8.0)}, "does not grow"),
    ],
)
def test_points_that_cannot_come_from_a_balloon_are_rejected_with_the_reason(columns, expected):
    assert expected in error_message(fit_radius, points(**columns))


def test_points_that_leave_the_radius_uncertain_in_the_validated_range_are_rejected():
    narrow = np.linspace(3, 6.5, 8)
    radii = noisy(1, Balloon().radius_mm(narrow))
    message = error_message(fit_radius, points(pressure_kpa=narrow, radius_mm=radii))
    assert "measure over a wider span" in message
