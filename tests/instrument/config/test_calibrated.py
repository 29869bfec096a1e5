"""Tests of a calibrated instrument: force, uncertainty, registers, and calibrations that are rejected."""

import math
import subprocess
import sys
from dataclasses import replace
from datetime import date

import pytest

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.calibration import file
from pneuforce.instrument.calibration.apply import (
    COMPENSATED_INPUTS,
    LAG_HEAT_RELATIVE_STD,
    apply_calibration,
)
from pneuforce.instrument.config import Configuration, load, parse
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.model import ForceLaw, estimate
from pneuforce.registers.codes import METHODS, STATUS
from pneuforce.registers.map import BY_NAME
from tests.instrument.calibration.test_calibration_file import COMPLETE, force_part
from tests.instrument.instrument_harness import VENT, InstrumentHarness

FORCE_ONLY = file.empty(0).model_copy(update={"force": force_part()})


def configured(tmp_path, calibration, text=""):
    file.save(calibration, tmp_path / "calibration.toml")
    path = tmp_path / "instrument.toml"
    path.write_text(f'{text}\n[measurement]\ncalibration = "calibration.toml"\n')
    return load(path)


def pressed(configuration, push_kpa=1.5):
    settings = configuration.settings()
    harness = InstrumentHarness.holding(chain=settings.chain, identity=settings.identity)
    harness.push_kpa = push_kpa
    return harness.run(0.8)


def test_the_force_is_the_force_of_the_law_times_the_correction(tmp_path):
    configuration = configured(tmp_path, FORCE_ONLY)
    harness = pressed(configuration)
    seen, settings = harness.snapshot(), configuration.chain
    baseline_kpa, rise_kpa = seen.baseline_pressure_kpa, seen.rise_kpa
    bare_n = estimate(
        baseline_kpa, baseline_kpa + rise_kpa, settings.balloon, settings.circuit, settings.law
    ).force_n
    factor = settings.correction.factor(rise_kpa, baseline_kpa)
    assert abs(factor - 1) > 0.05
    assert seen.force_n == pytest.approx(bare_n * factor, rel=1e-4)


def test_the_uncertainty_consists_of_the_residual_of_the_calibration_and_the_noise(tmp_path):
    part = FORCE_ONLY.force
    seen, before = pressed(configured(tmp_path, FORCE_ONLY)).snapshot(), pressed(Configuration()).snapshot()
    residual_n = math.hypot(part.residual_share * seen.force_n, part.residual_floor_n)
    assert residual_n < seen.force_std_n < residual_n + 0.03
    assert seen.force_std_n < 0.5 * before.force_std_n


def test_errors_that_are_equal_in_every_contact_are_removed_from_the_uncertainty(tmp_path):
    errors, before = (
        configured(tmp_path, FORCE_ONLY).chain.input_uncertainties,
        Configuration().chain.input_uncertainties,
    )
    removed = {*COMPENSATED_INPUTS}
    assert errors == replace(before, **dict.fromkeys(removed, 0.0))


def test_the_registers_report_the_calibration_and_its_date(tmp_path):
    seen, before = pressed(configured(tmp_path, FORCE_ONLY)).snapshot(), pressed(Configuration()).snapshot()
    codes = {name: code for code, name in METHODS.names.items()}
    assert (codes[before.method], codes[seen.method]) == (0, 256)
    assert BY_NAME["method"].address == 769
    assert (before.calibration_date, seen.calibration_date) == (0, 20260301)
    assert "calibrated" in seen.status
    assert "calibrated" not in before.status
    assert {bit.name: bit.number for bit in STATUS.bits}["calibrated"] == 28
    assert seen.configuration_hash != before.configuration_hash


def test_another_calibration_gives_another_hash(tmp_path):
    later = FORCE_ONLY.force.model_copy(update={"date": date(2026, 3, 2)})
    hashes = {
        configured(tmp_path, calibration).hash
        for calibration in (FORCE_ONLY, FORCE_ONLY.model_copy(update={"force": later}))
    }
    assert len(hashes) == 2


def test_another_balloon_removes_the_calibration(tmp_path):
    harness = InstrumentHarness.ready(chain=configured(tmp_path, FORCE_ONLY).chain)
    assert harness.snapshot().method == "energetic_calibrated"
    assert harness.run_command("new_balloon", 5) == ("done", "none")
    assert harness.snapshot().method == "energetic"
    settings, default = harness.instrument.chain.settings, Configuration().chain
    assert settings.input_uncertainties == default.input_uncertainties
    assert settings.model_uncertainty == default.model_uncertainty
    assert "calibrated" not in harness.snapshot().status


def test_the_balloon_of_the_calibration_keeps_the_calibration(tmp_path):
    harness = InstrumentHarness.ready(chain=configured(tmp_path, FORCE_ONLY).chain)
    assert harness.run_command("new_balloon", 0) == ("done", "none")
    assert harness.snapshot().method == "energetic_calibrated"


def test_radius_volume_and_lag_replace_the_defaults(tmp_path):
    measured = COMPLETE.model_copy(update={"force": None})
    settings = configured(tmp_path, measured, "[balloon]\nid = 7\n").chain
    assert settings.balloon.rest_radius_mm == pytest.approx(7.603)
    assert settings.circuit.volume_mm3 == 12_500
    assert settings.input_uncertainties.volume_mm3 == 300
    assert settings.tube_time_constant_s == 0.055
    assert settings.lag_relative_std == pytest.approx(math.hypot(0.001 / 0.055, LAG_HEAT_RELATIVE_STD))
    assert settings.correction is None


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("[balloon]\nid = 8\n", "belongs to balloon 0: correct the number"),
        ("[balloon]\nrest_radius_mm = 7.6\n", "balloon.rest_radius_mm = 7.6, but the force calibration was"),
        ("[balloon]\nrest_radius_mm = 7.6\n", "was made for 7.503: calibrate the force again"),
        ("[balloon]\nyoung_kpa = 1900.0\n", "balloon.young_kpa = 1900.0"),
        ("[circuit]\nvolume_mm3 = 1.3e4\n", "circuit.volume_mm3 = 13000.0, but the"),
    ],
)  # fmt: skip
def test_a_calibration_of_another_balloon_is_rejected_with_both_values(tmp_path, text, reason):
    with pytest.raises(ConfigurationError) as error:
        configured(tmp_path, FORCE_ONLY, text)
    assert reason in str(error.value)
    assert str(error.value).startswith(f"{tmp_path / 'instrument.toml'}: measurement.calibration: ")


@pytest.mark.parametrize("key", ["method", "switch", "low"])
def test_a_calibration_of_another_law_is_rejected(key):
    other = {"method": "lulevich", "switch": "paper", "low": "smooth"}[key]
    with pytest.raises(ConfigurationError, match=rf"measurement\.{key} = '{other}'"):
        parse({"measurement": {key: other}}, "x").with_calibration(FORCE_ONLY)


@pytest.mark.parametrize("made_for_method", ["energetic", "membrane"])
def test_a_calibration_of_another_method_is_rejected_without_the_values_that_only_one_of_them_has(
    made_for_method,
):
    law = {"method": "membrane", "grip": 0.6, "pressed_sides": 1}
    part = FORCE_ONLY.force
    membrane = FORCE_ONLY.model_copy(
        update={"force": part.model_copy(update={"made_for": part.made_for.model_copy(update=law)})}
    )
    calibration, configured = (membrane, {}) if made_for_method == "membrane" else (FORCE_ONLY, law)
    with pytest.raises(ConfigurationError, match=r"measurement\.method = ") as error:
        parse({"measurement": configured}, "x").with_calibration(calibration)
    assert "None" not in str(error.value)
    assert "grip" not in str(error.value)


def test_a_calibration_with_another_blend_width_is_rejected():
    made_for = FORCE_ONLY.force.made_for.model_copy(update={"blend_kpa": 0.25})
    older = FORCE_ONLY.model_copy(
        update={"force": FORCE_ONLY.force.model_copy(update={"made_for": made_for})}
    )
    with pytest.raises(ConfigurationError, match=r"the width of the blend = .* was made for 0\.25"):
        Configuration().with_calibration(older)


def test_a_configured_value_that_contradicts_the_calibration_is_rejected():
    measured = COMPLETE.model_copy(update={"force": None, "balloon_id": 0})
    with pytest.raises(
        ConfigurationError, match=r"tube_time_constant_s = 0\.1 contradicts the calibration, .* 0\.055"
    ):
        parse({"measurement": {"tube_time_constant_s": 0.1}}, "x").with_calibration(measured)


def test_a_missing_calibration_file_is_reported_with_its_name(tmp_path):
    path = tmp_path / "instrument.toml"
    path.write_text('[measurement]\ncalibration = "absent.toml"\n')
    with pytest.raises(ConfigurationError, match=r"absent\.toml: no such file"):
        load(path)


@pytest.mark.parametrize("method", ["lulevich", "shanahan"])
def test_the_older_methods_can_be_calibrated_too(method):
    settings = replace(ChainSettings(), law=ForceLaw(method=method))
    calibration = file.empty(0).model_copy(update={"force": force_part(settings)})
    harness = InstrumentHarness.ready(chain=apply_calibration(settings, calibration))
    harness.write_ok(VENT)
    assert harness.snapshot().method == f"{method}_calibrated"


def test_a_configuration_from_stdin_names_a_calibration_in_the_current_folder(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "pneuforce", "run", "--config", "/dev/stdin"],
        input='[measurement]\ncalibration = "absent.toml"\n',
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert "measurement.calibration: absent.toml: no such file" in done.stderr
