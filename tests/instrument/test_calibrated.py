"""A calibration in the instrument: it reaches force, uncertainty and registers, or is refused."""

import math
from dataclasses import replace
from datetime import date

import pytest

from instrument.calibration import file
from instrument.calibration.applied import calibrated
from instrument.chain import ChainSettings
from instrument.config import Configuration, load, parse
from instrument.errors import ConfigurationError
from instrument.model import Law, estimate
from registers.codes import METHODS, STATUS
from registers.map import BY_NAME
from tests.instrument.calibration.test_calibration_file import WHOLE, force_part
from tests.instrument.driving import VENT, Drive

FORCE_ONLY = file.empty(0).model_copy(update={"force": force_part()})


def configured(tmp_path, calibration, text=""):
    file.save(calibration, tmp_path / "calibration.toml")
    path = tmp_path / "instrument.toml"
    path.write_text(f'{text}\n[measurement]\ncalibration = "calibration.toml"\n')
    return load(path)


def pressed(configuration, push_kpa=1.5):
    settings = configuration.settings()
    drive = Drive.holding(chain=settings.chain, identity=settings.identity)
    drive.push_kpa = push_kpa
    return drive.run(0.8)


def test_the_force_shown_is_the_laws_times_the_correction(tmp_path):
    configuration = configured(tmp_path, FORCE_ONLY)
    drive = pressed(configuration)
    seen, own = drive.see(), configuration.chain
    initial_kpa, rise_kpa = seen.initial_pressure_kpa, seen.rise_kpa
    bare_n = estimate(initial_kpa, initial_kpa + rise_kpa, own.balloon, own.circuit, own.law).force_n
    factor = own.correction.factor(rise_kpa, initial_kpa)
    assert abs(factor - 1) > 0.05
    assert seen.force_n == pytest.approx(bare_n * factor, rel=1e-4)


def test_its_uncertainty_is_what_the_calibration_left_over_and_the_noise(tmp_path):
    part = FORCE_ONLY.force
    seen, before = pressed(configured(tmp_path, FORCE_ONLY)).see(), pressed(Configuration()).see()
    left_n = math.hypot(part.residual_share * seen.force_n, part.residual_floor_n)
    assert left_n < seen.force_std_n < left_n + 0.03
    assert seen.force_std_n < 0.5 * before.force_std_n


def test_what_is_wrong_alike_in_every_contact_of_the_balloon_leaves_the_budget(tmp_path):
    errors, before = configured(tmp_path, FORCE_ONLY).chain.errors, Configuration().chain.errors
    gone = {"radius_mm", "volume_mm3", "young_kpa", "rest_thickness_mm", "poisson"}
    assert errors == replace(before, **dict.fromkeys(gone, 0.0))


def test_the_registers_say_that_and_when_it_was_calibrated(tmp_path):
    seen, before = pressed(configured(tmp_path, FORCE_ONLY)).see(), pressed(Configuration()).see()
    codes = {name: code for code, name in METHODS.names.items()}
    assert (codes[before.method], codes[seen.method]) == (0, 256)
    assert BY_NAME["method"].address == 769
    assert (before.calibration_date, seen.calibration_date) == (0, 20260301)
    assert "calibrated" in seen.status
    assert "calibrated" not in before.status
    assert {bit.name: bit.number for bit in STATUS.bits}["calibrated"] == 28
    assert seen.configuration_hash != before.configuration_hash


def test_another_calibration_is_another_hash(tmp_path):
    later = FORCE_ONLY.force.model_copy(update={"date": date(2026, 3, 2)})
    hashes = {
        configured(tmp_path, calibration).hash
        for calibration in (FORCE_ONLY, FORCE_ONLY.model_copy(update={"force": later}))
    }
    assert len(hashes) == 2


def test_another_balloon_takes_the_calibration_away(tmp_path):
    drive = Drive.ready(chain=configured(tmp_path, FORCE_ONLY).chain)
    assert drive.see().method == "energetic_calibrated"
    assert drive.order("new_balloon", 5) == ("done", "none")
    assert drive.see().method == "energetic"
    assert "calibrated" not in drive.see().status


def test_the_balloon_of_the_calibration_keeps_it(tmp_path):
    drive = Drive.ready(chain=configured(tmp_path, FORCE_ONLY).chain)
    assert drive.order("new_balloon", 0) == ("done", "none")
    assert drive.see().method == "energetic_calibrated"


def test_radius_volume_and_lag_take_the_place_of_the_defaults(tmp_path):
    measured = WHOLE.model_copy(update={"force": None})
    own = configured(tmp_path, measured, "[balloon]\nid = 7\n").chain
    assert own.balloon.rest_radius_mm == pytest.approx(7.603)
    assert own.circuit.volume_mm3 == 12_500
    assert own.errors.volume_mm3 == 300
    assert own.tube_s == 0.055
    assert own.lag_share == pytest.approx(0.001 / 0.055)
    assert own.correction is None


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[balloon]\nid = 8\n", "balloon.id = 8, and the calibration is of balloon 0"),
        ("[balloon]\nrest_radius_mm = 7.6\n", "balloon.rest_radius_mm = 7.6, and its force calibration was"),
        ("[balloon]\nrest_radius_mm = 7.6\n", "was made for 7.503: calibrate the force again"),
        ("[balloon]\nyoung_kpa = 1900.0\n", "balloon.young_kpa = 1900.0"),
        ("[circuit]\nvolume_mm3 = 1.3e4\n", "circuit.volume_mm3 = 13000.0, and its"),
    ],
)  # fmt: skip
def test_a_calibration_of_another_balloon_is_refused_with_both_values(tmp_path, text, said):
    with pytest.raises(ConfigurationError) as told:
        configured(tmp_path, FORCE_ONLY, text)
    assert said in str(told.value)
    assert str(told.value).startswith(f"{tmp_path / 'instrument.toml'}: measurement.calibration: ")


@pytest.mark.parametrize("key", ["method", "switch", "low"])
def test_a_calibration_of_another_law_is_refused(key):
    other = {"method": "lulevich", "switch": "paper", "low": "smooth"}[key]
    with pytest.raises(ConfigurationError, match=rf"measurement\.{key} = '{other}'"):
        parse({"measurement": {key: other}}, "x").calibrated_by(FORCE_ONLY)


def test_a_calibration_of_a_release_that_blended_otherwise_is_refused():
    made_for = FORCE_ONLY.force.made_for.model_copy(update={"blend_kpa": 0.25})
    older = FORCE_ONLY.model_copy(
        update={"force": FORCE_ONLY.force.model_copy(update={"made_for": made_for})}
    )
    with pytest.raises(ConfigurationError, match=r"the width of the blend = .* was made for 0\.25"):
        Configuration().calibrated_by(older)


def test_a_value_that_somebody_configured_and_the_calibration_contradicts_is_refused():
    measured = WHOLE.model_copy(update={"force": None, "balloon_id": 0})
    with pytest.raises(ConfigurationError, match=r"tube_s = 0\.1 contradicts the calibration, .* 0\.055"):
        parse({"measurement": {"tube_s": 0.1}}, "x").calibrated_by(measured)


def test_a_missing_calibration_file_is_named(tmp_path):
    path = tmp_path / "instrument.toml"
    path.write_text('[measurement]\ncalibration = "absent.toml"\n')
    with pytest.raises(ConfigurationError, match=r"absent\.toml: no such file"):
        load(path)


@pytest.mark.parametrize("method", ["lulevich", "shanahan"])
def test_the_older_methods_can_be_calibrated_too(method):
    own = replace(ChainSettings(), law=Law(method=method))
    calibration = file.empty(0).model_copy(update={"force": force_part(own)})
    drive = Drive.ready(chain=calibrated(own, calibration))
    drive.must(VENT)
    assert drive.see().method == f"{method}_calibrated"
