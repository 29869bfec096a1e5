"""Tests of the golden calibration file. Each future release must compute the same forces from this file."""

import math
from pathlib import Path

import pytest

from pneuforce.instrument.calibration import file
from pneuforce.instrument.calibration.apply import apply_calibration
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.model.curve import ContactCurve
from tests.instrument.calibration.points import error_message

GOLDEN = Path(__file__).with_name("golden.toml")
UNCALIBRATED = ChainSettings()


def forces_n(settings, baseline_kpa, rise_kpa):
    """Return the force of one contact by both methods of `ContactCurve`."""
    curve = ContactCurve(
        baseline_kpa,
        settings.force_model,
        settings.correction,
        settings.input_uncertainties,
    )
    return curve.at(rise_kpa).estimate.force_n, curve.force_n(rise_kpa)


@pytest.mark.parametrize(
    ("baseline_kpa", "rise_kpa", "force_n"), [(6.0, 1.0, 0.90303), (9.2, 2.5, 2.44781), (10.5, 0.3, 0.31540)]
)
def test_the_golden_file_gives_the_forces_of_the_release_that_wrote_it(baseline_kpa, rise_kpa, force_n):
    settings = apply_calibration(UNCALIBRATED, file.load(GOLDEN))
    assert forces_n(settings, baseline_kpa, rise_kpa) == pytest.approx((force_n, force_n), abs=2e-5)


def test_the_forces_follow_from_the_coefficients_in_the_file():
    part = file.load(GOLDEN).force
    p, rise_kpa = 10.5 - part.made_for.middle_kpa, 2.0
    slope = part.by_rise + part.by_both_per_kpa * p
    factor = math.exp(part.constant + part.by_initial_per_kpa * p + part.by_step) * rise_kpa**slope
    uncalibrated_n, _ = forces_n(UNCALIBRATED, 10.5, rise_kpa)
    force_n, _ = forces_n(apply_calibration(UNCALIBRATED, file.load(GOLDEN)), 10.5, rise_kpa)
    assert force_n == pytest.approx(uncalibrated_n * factor, rel=1e-9)


@pytest.mark.parametrize(
    ("key", "other", "expected"),
    [
        ("middle_kpa = 8.0", "middle_kpa = 7.5", ("p is 0 = 8.0", "7.5")),
        ("blend_kpa = 1.0", "blend_kpa = 0.5", ("blend = 1.0", "0.5")),
    ],
)
def test_a_file_of_a_release_with_other_constants_is_rejected(tmp_path, key, other, expected):
    path = tmp_path / "calibration.toml"
    text = GOLDEN.read_text(encoding="utf-8")
    assert key in text
    path.write_text(text.replace(key, other), encoding="utf-8")
    message = error_message(apply_calibration, UNCALIBRATED, file.load(path))
    assert all(value in message for value in expected)


def test_a_truncated_file_is_reported_as_incomplete_before_any_other_error(tmp_path):
    path, text = tmp_path / "calibration.toml", GOLDEN.read_text(encoding="utf-8").rstrip()
    for length in (0, 200, 900, len(text) - 1, len(text) - 12):
        path.write_text(text[:length], encoding="utf-8")
        assert error_message(file.load, path).startswith(f"{path}: no complete calibration file")
    path.write_text(text, encoding="utf-8")
    assert file.load(path).force is not None
