"""Tests of the fit of the circuit volume by Boyle's law."""

import numpy as np
import pytest

from pneuforce.instrument.calibration.volume import fit_volume, read_strokes, strokes_from_options
from tests.instrument.calibration.points import error_message, points, share_within

AMBIENT_KPA, TRUTH_MM3 = 101.325, 12_680.0
DISPLACED_ML = np.array([0.5, 0.5, 1.0, 1.0, 1.5, 1.5])
RISES_KPA = AMBIENT_KPA * DISPLACED_ML * 1e3 / TRUTH_MM3


def volume(ambient_kpa=AMBIENT_KPA, **columns):
    return fit_volume(read_strokes(points(**columns)), ambient_kpa)


def test_boyles_law_gives_the_volume_in_either_unit():
    by_ml = volume(syringe_ml=DISPLACED_ML, pressure_kpa=RISES_KPA)
    by_mm3 = volume(volume_mm3=DISPLACED_ML * 1e3, pressure_kpa=RISES_KPA)
    assert by_ml.volume_mm3 == pytest.approx(TRUTH_MM3, rel=1e-6) == by_mm3.volume_mm3
    assert by_ml.residual_kpa < 1e-6


def test_the_fit_uses_the_pressure_before_the_stroke_and_the_ambient_pressure():
    after = [(95.0 + 2.0) * (1 + d * 1e3 / TRUTH_MM3) - 95.0 for d in (0.5, 1.0, 1.5)]
    fit = fit_volume(strokes_from_options([0.5, 1.0, 1.5], [2.0, 2.0, 2.0], after), 95.0)
    assert fit.volume_mm3 == pytest.approx(TRUTH_MM3, rel=1e-9)


def test_the_volume_lies_within_its_stated_uncertainty():
    generator, fits = np.random.default_rng(1), []
    for _ in range(300):
        syringe, gain = 1 + generator.uniform(-0.04, 0.04), 1 + generator.uniform(-0.01, 0.01)
        read = gain * RISES_KPA * syringe + generator.normal(0, 0.05, len(RISES_KPA))
        fits.append(volume(syringe_ml=DISPLACED_ML, pressure_kpa=read))
    errors, stds = [fit.volume_mm3 - TRUTH_MM3 for fit in fits], [fit.std_mm3 for fit in fits]
    # Of rectangular errors (syringe, sensor gain), 58 % lie within one standard uncertainty.
    assert 0.52 <= share_within(errors, stds) <= 0.79
    assert share_within(errors, stds, 2) >= 0.95


@pytest.mark.parametrize(
    ("columns", "expected"),
    [
        ({"syringe_ml": [1, 1], "pressure_kpa": [8, 8]}, "2 points, and at least 3"),
        ({"syringe_ml": [1, 1, 1], "pressure_kpa": [8, 8, 0]}, "line 4: the pressure does not rise"),
        ({"syringe_ml": [1, 1, 1], "pressure_kpa": [8, -8, 8]}, "line 3: the pressure does not rise"),
        ({"syringe_ml": [1, 0, 1], "pressure_kpa": [8, 8, 8]}, "line 3: a displaced volume of 0"),
        ({"syringe_ml": [1, 1, 1], "pressure_kpa": [80, 80, 80]}, "line 2: 80 kPa is above"),
        ({"syringe_ml": [1, 1e12, 1], "pressure_kpa": [8, 8, 8]}, "line 3: a displaced volume of 1e+15"),
        ({"syringe_ml": [1, 5e-324, 1], "pressure_kpa": [8, 8, 8]}, "line 3: a displaced volume of "),
        ({"syringe_ml": [900] * 3, "pressure_kpa": [8, 8, 8]}, "outside 100 to 1e+06 mm³"),
        ({"volume_mm3": [10] * 3, "pressure_kpa": [40, 40, 40]}, "outside 100"),
        ({"syringe_ml": [1, 1, 1], "pressure_kpa": [8, 8, 5]}, "line 4: this stroke deviates"),
    ],
)
def test_strokes_that_cannot_come_from_a_circuit_are_rejected_with_the_line(columns, expected):
    assert expected in error_message(lambda: volume(**columns))


def test_each_option_must_be_given_once_for_every_stroke():
    assert "once for every stroke" in error_message(strokes_from_options, [1.0, 1.0], [0.0], [8.0])
    assert "must be numbers" in error_message(strokes_from_options, [1.0], [0.0], [float("nan")])


@pytest.mark.filterwarnings("error")
def test_extreme_values_are_rejected_without_a_numpy_warning():
    assert "1e+15" in error_message(strokes_from_options, [1e308] * 3, [0.0] * 3, [8.0] * 3)
    assert "too large" in error_message(lambda: volume(syringe_ml=[1e308] * 3, pressure_kpa=[8] * 3))
    assert "1e+15 mm³" in error_message(lambda: volume(syringe_ml=[1e12] * 3, pressure_kpa=[8] * 3))
