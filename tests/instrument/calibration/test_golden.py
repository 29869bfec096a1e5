"""A calibration file that was made once: what it means must never change, whatever the program becomes."""

import math
from pathlib import Path

import pytest

from instrument.calibration import file
from instrument.calibration.applied import calibrated
from instrument.chain import ChainSettings
from instrument.model.curve import ContactCurve
from tests.instrument.calibration.points import refusal_of

GOLDEN = Path(__file__).with_name("golden.toml")
BARE = ChainSettings()


def forces_n(own, initial_kpa, rise_kpa):
    curve = ContactCurve(initial_kpa, own.balloon, own.circuit, own.law, own.correction, own.errors)
    return curve.at(rise_kpa).estimate.force_n, curve.force_n(rise_kpa)


@pytest.mark.parametrize(
    ("initial_kpa", "rise_kpa", "force_n"), [(6.0, 1.0, 0.90303), (9.2, 2.5, 2.44781), (10.5, 0.3, 0.31540)]
)
def test_its_forces_are_those_of_the_day_on_which_it_was_made(initial_kpa, rise_kpa, force_n):
    own = calibrated(BARE, file.load(GOLDEN))
    assert forces_n(own, initial_kpa, rise_kpa) == pytest.approx((force_n, force_n), abs=2e-5)


def test_they_are_what_its_own_numbers_say():
    part = file.load(GOLDEN).force
    p, rise_kpa = 10.5 - part.made_for.middle_kpa, 2.0
    slope = part.by_rise + part.by_both_per_kpa * p
    factor = math.exp(part.constant + part.by_initial_per_kpa * p + part.by_step) * rise_kpa**slope
    [bare_n, _], [force_n, _] = (
        forces_n(own, 10.5, rise_kpa) for own in (BARE, calibrated(BARE, file.load(GOLDEN)))
    )
    assert force_n == pytest.approx(bare_n * factor, rel=1e-9)


@pytest.mark.parametrize(
    ("key", "other", "said"),
    [
        ("middle_kpa = 8.0", "middle_kpa = 7.5", "the ΔP_i at which p is 0 = 8.0, and its force calibration"),
        ("blend_kpa = 1.0", "blend_kpa = 0.5", "the width of the blend = 1.0, and its force calibration"),
    ],
)
def test_a_file_of_another_meaning_is_refused(tmp_path, key, other, said):
    path = tmp_path / "calibration.toml"
    text = GOLDEN.read_text(encoding="utf-8")
    assert key in text
    path.write_text(text.replace(key, other), encoding="utf-8")
    assert said in refusal_of(calibrated, BARE, file.load(path))


def test_a_file_cut_short_is_told_as_that_before_anything_else(tmp_path):
    path, text = tmp_path / "calibration.toml", GOLDEN.read_text(encoding="utf-8").rstrip()
    for length in (0, 200, 900, len(text) - 1, len(text) - 12):
        path.write_text(text[:length], encoding="utf-8")
        assert refusal_of(file.load, path).startswith(f"{path}: cut short")
    path.write_text(text, encoding="utf-8")
    assert file.load(path).force is not None
