"""Tests of the calibration file: a saved file loads unchanged; the error of an invalid file names the key."""

from datetime import date

import numpy as np
import pytest

from pneuforce.instrument.calibration import file, parts
from pneuforce.instrument.calibration.force import fit_force
from pneuforce.instrument.calibration.lag import LagFit
from pneuforce.instrument.calibration.radius import fit_radius
from pneuforce.instrument.calibration.residuals import errors_by_pressure
from pneuforce.instrument.calibration.volume import VolumeFit
from pneuforce.instrument.model import Balloon
from tests.instrument.calibration.points import error_message, points
from tests.instrument.calibration.test_force import SETTINGS, TRUTH, simulated_contacts

TODAY = date(2026, 3, 1)
PRESSURES_KPA = np.linspace(2.0, 11.5, 22)
CALIPER = points(pressure_kpa=PRESSURES_KPA, radius_mm=Balloon().radius_mm(PRESSURES_KPA) + 0.1)


def force_part(settings=SETTINGS, today=TODAY, **truth):
    contacts, _ = simulated_contacts(1, settings=settings, **truth or TRUTH)
    calibration = fit_force(contacts, settings)
    errors = errors_by_pressure(calibration.chosen.held_out_n, calibration.contacts)
    return parts.force_part(calibration, errors, CALIPER, settings, today)


def complete_calibration():
    return file.empty(7).model_copy(
        update={
            "radius": parts.radius_part(fit_radius(CALIPER), CALIPER, TODAY),
            "volume": parts.volume_part(VolumeFit(12_500.0, 300.0, 0.02), CALIPER, 101.325, date(2026, 2, 1)),
            "lag": parts.lag_part(LagFit(0.055, 0.001, -3.0, 0.01), CALIPER, TODAY),
            "force": force_part(),
        }
    )


COMPLETE = complete_calibration()


def write_file(tmp_path, text):
    path = tmp_path / "calibration.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_saved_calibration_is_loaded_unchanged(tmp_path):
    path = tmp_path / "calibration.toml"
    file.save(COMPLETE, path)
    assert file.load(path) == COMPLETE
    assert [p.name for p in tmp_path.iterdir()] == ["calibration.toml"]


def test_each_part_has_its_date_and_its_source(tmp_path):
    for part in file.load(write_file(tmp_path, file.to_toml(COMPLETE))).parts:
        assert (part.source, part.source_sha256, part.points) == ("mine.csv", CALIPER.sha256, 22)
    assert COMPLETE.date_code == 20260301
    assert file.empty(0).date_code == 0


def test_names_with_quotes_and_backslashes_are_kept(tmp_path):
    radius = COMPLETE.radius.model_copy(update={"source": 'C:\\new "one"\n\x7f é.csv'})
    path = write_file(tmp_path, file.to_toml(COMPLETE.model_copy(update={"radius": radius})))
    assert file.load(path).radius.source == radius.source


def test_every_truncated_file_is_rejected_with_the_file_name(tmp_path):
    text = file.to_toml(COMPLETE)
    for length in [*range(0, len(text) - len("true\n"), 37), len(text) - len("true\n") - 1]:
        message = error_message(file.load, write_file(tmp_path, text[:length]))
        assert all(line.startswith(f"{tmp_path / 'calibration.toml'}: ") for line in message.splitlines())


LAG = "tube_time_constant_s = 0.055"


@pytest.mark.parametrize(
    ("old", "new", "facts"),
    [
        ("version = 1", "version = 2", ["version = 2"]),
        (LAG, "tube_time_constant_s = 5.5", ["lag.tube_time_constant_s = 5.5", "0.001", "0.5"]),
        (LAG, "tube_time_constant_s = nan", ["lag.tube_time_constant_s = nan"]),
        (LAG, 'tube_time_constant_s = "0.055"', ["lag.tube_time_constant_s = '0.055'"]),
        (LAG, "tube_ms = 55", ["lag.tube_ms", "unknown key", "date, source,"]),
        (LAG, "", ["lag.tube_time_constant_s", "missing"]),
        ("balloon_id = 7", "balloon_id = -7", ["balloon_id = -7"]),
        ('switch = "blend"', 'switch = "none"', ["force.made_for.switch = 'none'"]),
        ("date = 2026-02-01", "date = 20260201", ["volume.date = 20260201"]),
        (
            "date = 2026-02-01",
            "date = 2019-01-01",
            ["volume.date = 2019-01-01: ", "allowed: 2020-01-01 to 2099-12-31"],
        ),
        ("[lag]", "[leg]", ["leg", "unknown key", "version, balloon_id, radius,"]),
        ("rise_low_kpa = 0.", "rise_low_kpa = 9.", ["rise_low_kpa is above rise_high_kpa"]),
        ("whole = true", "whole = false", ["end.whole = False"]),
    ],
)
def test_an_invalid_value_is_rejected_with_file_key_and_allowed_range(tmp_path, old, new, facts):
    text = file.to_toml(COMPLETE)
    assert old in text
    path = write_file(tmp_path, text.replace(old, new, 1))
    message = error_message(file.load, path)
    assert message.startswith(f"{path}: ")
    assert [fact for fact in facts if fact not in message] == []


KEY_LINES = [
    n for n, line in enumerate(file.to_toml(COMPLETE).splitlines()) if " = " in line and line[0] != "#"
]


@pytest.mark.parametrize(
    "value", ["nan", "-1e300", '"x"', "[]", "{}", "[[[1]]]", "true", "2026-01-01T00:00:00"]
)
def test_every_invalid_value_of_every_key_gives_a_short_message_with_the_key(tmp_path, value):
    for n in KEY_LINES:
        lines = file.to_toml(COMPLETE).splitlines()
        key = lines[n].split(" = ")[0]
        lines[n] = f"{key} = {value}"
        if (key, value) in (("source", '"x"'), ("whole", "true"), ("bin", "[]")):
            continue  # these values are valid
        message = error_message(file.load, write_file(tmp_path, "\n".join(lines)))
        assert f"{key}" in message
        assert message.count("\n") < 6


def test_the_message_about_a_missing_file_names_the_command_that_writes_one(tmp_path):
    assert "pneuforce calibrate force" in error_message(file.load, tmp_path / "absent.toml")


def test_a_file_that_cannot_be_written_raises_a_configuration_error(tmp_path):
    path = tmp_path / "absent" / "calibration.toml"
    assert "cannot be written" in error_message(file.save, COMPLETE, path)
