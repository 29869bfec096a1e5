"""Tests of `estimate`, `uncertainty` and `validate` with a configuration, and with tables of contacts."""

import csv
import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from pneuforce.errors import ConfigurationError, InvalidForce
from pneuforce.instrument.cli.app import app
from pneuforce.instrument.config import load
from pneuforce.instrument.validation.accuracy import estimate_forces

ROOT = Path(__file__).parents[4]
CONTACTS = ROOT / "docs/examples/reference-contacts.csv"
RADIUS = ROOT / "docs/examples/radius.csv"
RECORDING = ROOT / "docs/examples/validation-recording.csv"


def succeed(*words):
    done = CliRunner().invoke(app, [*map(str, words)])
    assert done.exit_code == 0, done.output
    return done.stdout


def error_line(*words):
    """Return the message of the error that ends the command. It has a single line."""
    done = CliRunner().invoke(app, [*map(str, words)])
    assert isinstance(done.exception, ConfigurationError), done.output
    assert done.stdout == ""
    assert "\n" not in str(done.exception)
    return str(done.exception)


@pytest.fixture(scope="module")
def config(tmp_path_factory):
    """Return a configuration with a force calibration of the rubber balloon."""
    folder = tmp_path_factory.mktemp("calibrated")
    succeed("calibrate", "force", CONTACTS, "--out", folder / "calibration.toml")
    (folder / "instrument.toml").write_text('[measurement]\ncalibration = "calibration.toml"\n')
    return folder / "instrument.toml"


def rows_of(text):
    return list(csv.DictReader(text.splitlines()))


@pytest.mark.parametrize("pressures", [(8.0, 9.2), (10.0, 10.2)])
def test_with_a_configuration_the_force_is_that_of_the_instrument(config, pressures):
    baseline_kpa, final_kpa = pressures
    words = ("--dpi", baseline_kpa, "--dpf", final_kpa, "--json")
    estimated = json.loads(succeed("estimate", *words, "--config", config))
    (force_n,), (std_n,) = estimate_forces([pressures], load(config).chain)
    assert estimated["force_n"] == pytest.approx(force_n, abs=1e-5)
    assert estimated["force_std_n"] == pytest.approx(std_n, abs=1e-5)
    assert json.loads(succeed("uncertainty", *words, "--config", config))["force_std_n"] == pytest.approx(
        std_n, abs=1e-5
    )
    assert abs(estimated["force_n"] - json.loads(succeed("estimate", *words))["force_n"]) > 0.01


def test_an_option_that_contradicts_the_configuration_is_rejected(config):
    for words in (("--method", "lulevich"), ("--calibration", "x.toml"), ("--low", "line")):
        message = error_line("estimate", "--dpi", 8, "--dpf", 9, "--config", config, *words)
        assert words[0] in message
        assert "--config" in message


def test_the_law_is_that_of_the_calibration_unless_an_option_contradicts(config):
    words = ("estimate", "--dpi", 8, "--dpf", 9.2, "--calibration", config.with_name("calibration.toml"))
    estimated = json.loads(succeed(*words, "--json"))
    configured = json.loads(succeed("estimate", "--dpi", 8, "--dpf", 9.2, "--config", config, "--json"))
    assert (estimated["switch"], estimated["force_n"]) == ("blend", configured["force_n"])
    assert json.loads(succeed(*words, "--switch", "blend", "--json")) == estimated
    assert "'paper'" in error_line(*words, "--switch", "paper")


def test_a_table_without_any_valid_force_ends_with_an_error(tmp_path):
    file = tmp_path / "noted.csv"
    file.write_text("baseline_kpa,final_kpa\n4,5\n")
    done = CliRunner().invoke(app, ["estimate", "--csv", str(file)])
    assert isinstance(done.exception, InvalidForce)
    assert [row["force_n"] for row in rows_of(done.stdout)] == [""]


@pytest.mark.parametrize("command", ["estimate", "uncertainty"])
def test_a_table_without_contacts_is_rejected(tmp_path, command):
    file, out = tmp_path / "head.csv", tmp_path / "forces.csv"
    file.write_text("# noted by hand\nbaseline_kpa,final_kpa\n\n")
    for words in ((), ("--json",), ("--out", out)):
        assert str(file) in error_line(command, "--csv", file, *words)
    assert not out.exists()


def test_a_table_keeps_its_columns_and_gets_the_force_of_each_contact(config):
    rows = rows_of(succeed("estimate", "--csv", CONTACTS, "--config", config))
    assert len(rows) == 24
    for row in rows[:3]:
        pressures = float(row["baseline_kpa"]), float(row["final_kpa"])
        (force_n,), (std_n,) = estimate_forces([pressures], load(config).chain)
        assert float(row["force_n"]) == pytest.approx(force_n, rel=1e-5)
        assert float(row["force_std_n"]) == pytest.approx(std_n, rel=1e-5)
        assert float(row["force_n"]) == pytest.approx(float(row["input_force_n"]), rel=0.1)


@pytest.mark.parametrize("command", ["estimate", "uncertainty"])
@pytest.mark.parametrize(("final_kpa", "valid"), [("12.81", True), ("12.83", True), ("12.87", False)])
def test_a_valid_force_has_an_uncertainty_up_to_the_end_of_the_membrane_table(
    tmp_path, command, final_kpa, valid
):
    file = tmp_path / "calibration.toml"
    succeed("calibrate", "radius", RADIUS, "--out", file)
    succeed(
        *["calibrate", "grip", "--mass-g", "150", "--before-kpa", "8.0", "--after-kpa", "9.4", "--out"], file
    )
    words = ("--dpi", "8", "--dpf", final_kpa, "--method", "membrane", "--calibration", str(file))
    for form in ((), ("--json",)):
        done = CliRunner().invoke(app, [command, *words, *form])
        assert done.exit_code == (0 if valid else 1)
        assert "nan" not in done.stdout
    answer = json.loads(done.stdout)
    assert answer["valid"] is valid
    assert (answer["force_n"] is not None, answer["force_std_n"] is not None) == (valid, valid)
    assert bool(answer["reasons"]) is not valid


def test_a_contact_without_a_force_has_an_empty_cell_and_a_reason(tmp_path):
    file = tmp_path / "contacts.csv"
    file.write_text('place,p_i,p_f\n"left, above",8,9.2\nright,4.9,6\nright,8,7\nright,8,49\nleft,8,8.3\n')
    rows = rows_of(succeed("estimate", "--csv", file))
    assert [row["place"] for row in rows] == ["left, above", "right", "right", "right", "left"]
    assert [row["valid"] for row in rows] == ["1", "0", "0", "0", "1"]
    assert [bool(row["force_n"]) for row in rows] == [True, False, False, False, True]
    assert [bool(row["force_std_n"]) for row in rows] == [True, False, False, False, True]
    assert [bool(row["reason"]) for row in rows] == [False, True, True, True, True]
    facts = json.loads(succeed("estimate", "--csv", file, "--json"))["contacts"]
    assert [row["force_n"] is None for row in facts] == [False, True, True, True, False]
    assert [row["columns"] for row in facts][:2] == [{"place": "left, above"}, {"place": "right"}]


def test_two_pairs_of_pressures_in_one_table_are_refused(tmp_path):
    file = tmp_path / "contacts.csv"
    file.write_text("dpi_kpa,dpf_kpa,baseline_kpa,final_kpa\n8,9.2,7,9\n")
    assert "have the same meaning: keep one pair" in error_line("estimate", "--csv", file)


def test_a_missing_pressure_gives_no_force(tmp_path):
    file = tmp_path / "contacts.csv"
    file.write_text("baseline_kpa,final_kpa\n8,9.2\nnan,9.2\n8,NaN\n8,\n")
    for command in ("estimate", "uncertainty"):
        rows = rows_of(succeed(command, "--csv", file))
        assert [row["valid"] for row in rows] == ["1", "0", "0", "0"]
        assert {(row["force_n"], row["force_std_n"], bool(row["reason"])) for row in rows[1:]} == {
            ("", "", True)
        }
    result = json.loads(succeed("estimate", "--csv", file, "--json"), parse_constant=pytest.fail)
    facts = result["contacts"]
    assert [row["valid"] for row in facts] == [True, False, False, False]
    assert [(row["baseline_kpa"], row["final_kpa"], row["force_n"]) for row in facts[1:]] == [
        (None, 9.2, None),
        (8.0, None, None),
        (8.0, None, None),
    ]


@pytest.mark.parametrize("cell", ["9;2", "x", "inf", "-nan", "9.2kPa", "1e400"])
def test_a_cell_that_is_no_number_is_refused_with_its_line(tmp_path, cell):
    file = tmp_path / "contacts.csv"
    file.write_text(f"baseline_kpa,final_kpa\n8,9.2\n8,{cell}\n")
    assert "line 3: final_kpa" in error_line("estimate", "--csv", file)


@pytest.mark.parametrize(
    ("method", "names"),
    [
        (
            "energetic",
            {"switch", "low", "stretching_energy_mj", "bending_energy_mj", "compression_energy_mj"},
        ),
        ("lulevich", {"low"}),
        ("shanahan", {"low"}),
        ("membrane", {"grip", "pressed_sides"}),
    ],
)
def test_the_json_has_only_the_properties_of_the_method(method, names):
    all_names = {
        *("switch", "low", "stretching_energy_mj", "bending_energy_mj", "compression_energy_mj"),
        *("grip", "pressed_sides"),
    }
    for command in ("estimate", "uncertainty"):
        facts = json.loads(succeed(command, "--dpi", 8, "--dpf", 9.2, "--method", method, "--json"))
        assert facts.keys() & all_names == names


def test_the_parts_of_the_uncertainty_of_each_contact_add_up(tmp_path):
    file = tmp_path / "contacts.csv"
    file.write_text("dpi_kpa,dpf_kpa\n4,5\n8,9.2\n")
    empty, row = rows_of(succeed("uncertainty", "--csv", file))
    parts = [float(value) for name, value in row.items() if name.endswith("(N)")]
    assert len(parts) == 12
    assert sum(part**2 for part in parts) ** 0.5 == pytest.approx(float(row["force_std_n"]), rel=1e-4)
    assert {value for name, value in empty.items() if name.endswith("(N)")} == {""}


def test_contacts_that_have_just_begun_are_less_certain(tmp_path):
    table = tmp_path / "contacts.csv"
    table.write_text("baseline_kpa,final_kpa\n8.0,9.2\n", encoding="utf-8")
    words = ("uncertainty", "--csv", table, "--method", "membrane")
    (soon,), (later,) = (rows_of(succeed(*words, *age)) for age in (("--contact-s", "0"), ()))
    heat = "gas exponent n, 1 at rest (N)"
    assert float(soon[heat]) > 0.03
    assert float(later[heat]) == 0.0
    assert float(soon["force_std_n"]) > float(later["force_std_n"])


def test_an_output_file_is_replaced_only_on_request(tmp_path):
    out = tmp_path / "forces.csv"
    words = ("estimate", "--csv", CONTACTS, "--out", out)
    assert succeed(*words) == ""
    out.write_text("old")
    assert "--overwrite" in error_line(*words)
    assert out.read_text() == "old"
    succeed(*words, "--overwrite")
    assert len(rows_of(out.read_text())) == 24


@pytest.mark.parametrize(
    "words",
    [
        (),
        ("--dpi", 8),
        ("--csv", CONTACTS, "--dpi", 8),
        ("--csv", CONTACTS, "--dpi", 8, "--dpf", 9),
        ("--csv", RECORDING),
        ("--csv", "/nowhere.csv"),
    ],
)
def test_incomplete_or_contradictory_pressures_are_rejected(words):
    error_line("estimate", *words)


def test_validate_shows_the_errors_of_the_calibrated_instrument(config):
    plain = json.loads(succeed("validate", "--data", RECORDING, "--json"))
    report = json.loads(succeed("validate", "--data", RECORDING, "--json", "--config", config))
    assert plain["instrument_errors"] == []
    [errors, *_] = report["instrument_errors"]
    [law, *_] = plain["peak_errors_percent"]
    assert errors["solved"] == law["count"] == 9
    assert errors["absolute"] < 0.2 * law["energetic"]["absolute"]
    assert errors["within_2u_percent"] >= 90
    assert report["continuous"]["compensated_n"] < 0.3 * plain["continuous"]["compensated_n"]
    assert report["source"]["configuration"] == "instrument.toml"
    assert "--switch" in error_line("validate", "--data", RECORDING, "--config", config, "--switch", "blend")
