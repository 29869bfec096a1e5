"""Tests of the grip calibration: known weights determine the grip, and wrong weights are rejected."""

from dataclasses import replace
from datetime import date

import numpy as np
import pytest

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.calibration import file, parts
from pneuforce.instrument.calibration.apply import apply_calibration
from pneuforce.instrument.calibration.grip import GRAVITY_M_PER_S2, fit_grip, weights_from_options
from pneuforce.instrument.measurement.chain import Chain
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.model import Balloon, ForceLaw
from pneuforce.instrument.model.method_uncertainty import without_force_reference

#: A balloon whose radii were measured: they differ a little from those of the paper.
SETTINGS = ChainSettings.of(ForceLaw(method="membrane"), Balloon(rest_radius_mm=7.51))


def after_kpa(mass_g, before_kpa, grip):
    """Return the pressure under a weight on a balloon with this grip."""
    model = replace(SETTINGS, law=replace(SETTINGS.law, grip=grip)).force_model
    finals = before_kpa + np.linspace(0.05, 6, 600)
    forces = model.estimate(np.full(600, before_kpa), finals).force_n
    known = np.isfinite(forces)
    return float(np.interp(mass_g * 1e-3 * GRAVITY_M_PER_S2, forces[known], finals[known]))


def weights(*rows):
    """Return weights. Each row has mass, ΔP_i and ΔP_f."""
    return weights_from_options(*([float(value) for value in column] for column in zip(*rows, strict=True)))


@pytest.mark.parametrize("grip", [0.0, 0.35, 1.0, 1.2])
def test_one_weight_determines_the_grip(grip):
    found = fit_grip(weights((100, 8.0, after_kpa(100, 8.0, grip))), SETTINGS)
    assert found.grip == pytest.approx(grip, abs=0.01)
    assert 0.02 < found.std < 0.1


def test_more_weights_average_their_readings():
    rows = [(mass, 8.0, after_kpa(mass, 8.0, 0.6)) for mass in (60, 100, 150, 200, 250)]
    noisy = [
        (m, p, q + error) for (m, p, q), error in zip(rows, (0.02, -0.02, 0.01, -0.01, 0.0), strict=True)
    ]
    found = fit_grip(weights(*noisy), SETTINGS)
    assert found.grip == pytest.approx(0.6, abs=3 * found.std)
    assert np.ptp(found.each) > 0.1


@pytest.mark.parametrize(
    ("row", "named"),
    [
        ((1, 8.0, 8.9), "mass_g"),
        ((5000, 8.0, 8.9), "mass_g"),
        ((-100, 8.0, 8.9), "mass_g"),
        ((100, 3.0, 3.9), "before_kpa"),
        ((100, 8.0, 8.0), "after_kpa"),
        ((100, 8.0, 7.0), "after_kpa"),
        ((100, 8.0, 11.0), "grip"),
        ((100, 8.0, 20.0), "no solution"),
        ((200, 8.0, 8.2), "grip"),
    ],
)
def test_an_impossible_weight_is_rejected_with_its_line(row, named):
    with pytest.raises(ConfigurationError, match=named):
        fit_grip(weights(row), SETTINGS)


def test_a_calibrated_grip_replaces_the_unknown_grip():
    points = weights((100, 8.0, after_kpa(100, 8.0, 0.8)))
    part = parts.grip_part(fit_grip(points, SETTINGS), points, SETTINGS, date(2026, 1, 2))
    content = file.empty(0).model_copy(update={"grip": part})
    applied = apply_calibration(SETTINGS, content)
    assert applied.law.grip == pytest.approx(0.8, abs=0.01)
    assert applied.input_uncertainties.grip == part.grip_std
    assert apply_calibration(ChainSettings(), content) == ChainSettings()


def test_a_grip_of_another_balloon_is_rejected():
    points = weights((100, 8.0, after_kpa(100, 8.0, 0.8)))
    part = parts.grip_part(fit_grip(points, SETTINGS), points, SETTINGS, date(2026, 1, 2))
    content = file.empty(0).model_copy(update={"grip": part})
    other = replace(SETTINGS, circuit=replace(SETTINGS.circuit, volume_mm3=10_000.0))
    with pytest.raises(ConfigurationError, match="calibrate the grip again"):
        apply_calibration(other, content)


def test_another_balloon_has_an_unknown_grip_again():
    points = weights((100, 8.0, after_kpa(100, 8.0, 0.9)))
    part = parts.grip_part(fit_grip(points, SETTINGS), points, SETTINGS, date(2026, 1, 2))
    chain = Chain(apply_calibration(SETTINGS, file.empty(0).model_copy(update={"grip": part})))
    chain.remove_calibration()
    unknown = without_force_reference(SETTINGS.law, Balloon())
    assert chain.settings == replace(SETTINGS, model_uncertainty=unknown)
    curve, _ = chain._curve_at(8.0, 0.01)
    assert curve.at(1.0).estimate == pytest.approx(SETTINGS.force_model.estimate(8.0, 9.0), abs=1e-3)


def test_the_grip_is_rejected_before_the_radii_of_the_balloon_are_measured():
    settings = ChainSettings.of(ForceLaw(method="membrane"))
    with pytest.raises(ConfigurationError, match="calibrate radius"):
        fit_grip(weights((100, 8.0, 8.9)), settings)
