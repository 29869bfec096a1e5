"""The radius from a caliper: the paper's quadratic comes back, and what is no balloon's is refused."""

import numpy as np
import pytest

from instrument.calibration.radius import radius_of
from instrument.calibration.rubber import LIMIT_SHARE, free_radius_mm
from instrument.model import Balloon
from tests.instrument.calibration.points import points, refusal_of, share_within

PRESSURES_KPA = np.linspace(2.0, 11.5, 22)
TRUTH = (Balloon().rest_radius_mm, Balloon().radius_linear_mm_per_kpa, Balloon().radius_quadratic_mm_per_kpa2)
PAPER_MM = Balloon().radius_mm(PRESSURES_KPA)


def noisy(seed, radii_mm=PAPER_MM, std_mm=0.03):
    return radii_mm + np.random.default_rng(seed).normal(0, std_mm, len(radii_mm))


def test_the_papers_22_points_give_the_papers_quadratic():
    found = radius_of(points(pressure_kpa=PRESSURES_KPA, diameter_mm=2 * PAPER_MM))
    assert found.quadratic.coefficients == pytest.approx(TRUTH, rel=1e-6)
    assert found.quadratic.std < 1e-6


def test_radii_and_diameters_tell_the_same():
    by_radius = radius_of(points(pressure_kpa=PRESSURES_KPA, radius_mm=PAPER_MM))
    by_diameter = radius_of(points(pressure_kpa=PRESSURES_KPA, diameter_mm=2 * PAPER_MM))
    assert by_radius.quadratic.coefficients == pytest.approx(by_diameter.quadratic.coefficients)


def test_coefficients_and_radii_lie_within_their_stated_uncertainty():
    draws = [radius_of(points(pressure_kpa=PRESSURES_KPA, radius_mm=noisy(n))) for n in range(200)]
    for k in range(3):
        errors = [draw.quadratic.coefficients[k] - TRUTH[k] for draw in draws]
        assert 0.57 <= share_within(errors, [draw.quadratic.stds[k] for draw in draws]) <= 0.79
    errors = [draw.radius_mm(8.0) - Balloon().radius_mm(8.0) for draw in draws]
    assert 0.57 <= share_within(errors, [draw.std_mm(8.0) for draw in draws]) <= 0.79
    assert np.mean([draw.quadratic.std for draw in draws]) == pytest.approx(0.03, rel=0.05)


def test_the_limit_point_of_a_rubber_balloon_is_found_within_its_stated_uncertainty():
    truth_kpa = 12.94
    radii = free_radius_mm(PRESSURES_KPA, 7.503, truth_kpa / LIMIT_SHARE)
    draws = [radius_of(points(pressure_kpa=PRESSURES_KPA, radius_mm=noisy(n, radii))) for n in range(100)]
    errors = [draw.rubber.limit_kpa - truth_kpa for draw in draws]
    assert max(map(abs, errors)) < 0.3
    assert 0.54 <= share_within(errors, [draw.rubber.limit_std_kpa for draw in draws]) <= 0.82


def test_setpoints_near_the_limit_point_are_warned_of():
    stiff = radius_of(points(pressure_kpa=PRESSURES_KPA, radius_mm=free_radius_mm(PRESSURES_KPA, 7.5, 40.0)))
    soft = radius_of(points(pressure_kpa=PRESSURES_KPA, radius_mm=free_radius_mm(PRESSURES_KPA, 7.5, 20.88)))
    assert stiff.rubber.warning(12.0) == ""
    assert "near 12.94 ± " in soft.rubber.warning(12.0)
    assert "below 11.65 kPa" in soft.rubber.warning(12.0)
    assert soft.rubber.warning(11.6) == ""


def with_row(row, radius_mm):
    radii = PAPER_MM.copy()
    radii[row] = radius_mm
    return radii


@pytest.mark.parametrize(
    ("columns", "said"),
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
            "to tell a curve",
        ),
        ({"pressure_kpa": PRESSURES_KPA, "radius_mm": np.full(22, 8.0)}, "does not grow"),
    ],
)
def test_what_no_caliper_at_a_balloon_shows_is_refused_with_the_reason(columns, said):
    assert said in refusal_of(radius_of, points(**columns))


def test_points_that_cannot_tell_the_radius_where_it_is_needed_are_refused():
    near = np.linspace(3, 6.5, 8)
    said = refusal_of(radius_of, points(pressure_kpa=near, radius_mm=noisy(1, Balloon().radius_mm(near))))
    assert "measure over a wider span" in said
