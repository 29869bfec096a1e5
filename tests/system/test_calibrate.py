"""Tests of `pneuforce calibrate` from the documented examples to a calibrated instrument."""

import json
import re
import shutil
import tomllib
from itertools import groupby
from pathlib import Path

import pytest
from typer.testing import CliRunner

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.calibration import file
from pneuforce.instrument.cli.app import app
from pneuforce.instrument.config import load
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.model import LIVE_LAW, Balloon, Circuit, estimate
from pneuforce.instrument.studies.measured_playback import measure_playback
from pneuforce.sim.headless import Playback
from pneuforce.sim.scenario import Scenario
from tests.command_runner import pneuforce
from tests.instrument.calibration.plant_contacts import plant_contacts
from tests.instrument.cli.terminal.test_failure import KEYS

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "docs/examples"
PARTS = {"radius": "radius.csv", "volume": "volume.csv", "lag": "lag.csv", "force": "reference-contacts.csv"}
#: Files of a running instrument. A command with such a file is tested elsewhere.
INSTRUMENT_FILES = ("press.recording", "instrument.toml")
COMMANDS = [
    line.removeprefix(".venv/bin/pneuforce calibrate ").split()
    for block in re.findall(r"```sh\n(.*?)```", (ROOT / "docs/calibration.md").read_text(), re.S)
    for line in block.replace("\\\n", " ").splitlines()
    if line.startswith(".venv/bin/pneuforce calibrate ")
    if not any(name in line for name in INSTRUMENT_FILES)
]


def calibrate(*words):
    """Run the command and return its output. Raise a ConfigurationError, which main() would print."""
    done = CliRunner().invoke(app, ["calibrate", *map(str, words)])
    if done.exception and not isinstance(done.exception, SystemExit):
        raise done.exception
    assert done.exit_code == 0, done.output
    return done.stdout


@pytest.fixture(scope="module")
def calibration_path(tmp_path_factory):
    """Return a calibration file with all parts, made from the documented examples."""
    path = tmp_path_factory.mktemp("calibration") / "calibration.toml"
    for part, name in PARTS.items():
        calibrate(part, EXAMPLES / name, "--out", path)
    return path


def test_the_commands_of_the_document_have_the_documented_results(tmp_path, monkeypatch):
    (tmp_path / "docs").symlink_to(ROOT / "docs")
    monkeypatch.chdir(tmp_path)
    assert len(COMMANDS) == 8
    for words in COMMANDS:
        words, _, redirected = " ".join(words).partition(" > ")
        output = calibrate(*words.split())
        if redirected:
            comment, header, *rows = (EXAMPLES / redirected).read_text().splitlines()
            assert "--plant membrane --count 24 --seed 1" in comment
            assert output.splitlines()[0] == header
            for written, expected in zip(output.splitlines()[1:], rows, strict=True):
                numbers = [[float(cell) for cell in line.split(",")] for line in (written, expected)]
                assert numbers[0] == pytest.approx(numbers[1], abs=2e-5)
    assert len(file.load(tmp_path / "calibration.toml").parts) == 5


def test_a_part_that_is_replaced_is_named_with_its_date(tmp_path):
    out = tmp_path / "calibration.toml"
    first, second = (calibrate("volume", EXAMPLES / "volume.csv", "--out", out) for _ in range(2))
    date = file.load(out).volume.date.isoformat()
    assert (date in first, date in second) == (False, True)


def test_each_part_is_added_to_the_same_file(calibration_path):
    calibration = file.load(calibration_path)
    assert len(calibration.parts) == 4
    assert calibration.volume.volume_mm3 == pytest.approx(12_680, abs=2 * calibration.volume.volume_std_mm3)
    assert calibration.lag.tube_time_constant_s == pytest.approx(0.06, abs=0.001)
    assert calibration.radius.rest_radius_mm == pytest.approx(7.503, abs=0.05)


def test_the_force_calibration_uses_the_measured_radius_and_volume(calibration_path):
    calibration = file.load(calibration_path)
    assert calibration.force.made_for.rest_radius_mm == calibration.radius.rest_radius_mm
    assert calibration.force.made_for.volume_mm3 == calibration.volume.volume_mm3
    assert calibration.force.after_unseen.mean_error_percent < 5 < calibration.force.before.mean_error_percent


def test_an_instrument_loads_the_file(calibration_path):
    (calibration_path.parent / "instrument.toml").write_text(
        '[measurement]\ncalibration = "calibration.toml"\n'
    )
    settings = load(calibration_path.parent / "instrument.toml").settings()
    assert settings.chain.correction is not None
    assert settings.identity.calibration_date == file.load(calibration_path).date_code


def test_a_step_without_a_file_to_write_builds_on_the_configured_calibration(calibration_path, tmp_path):
    copy, config = tmp_path / "calibration.toml", tmp_path / "instrument.toml"
    shutil.copy(calibration_path, copy)
    config.write_text('[measurement]\ncalibration = "calibration.toml"\n')
    words = ("force", EXAMPLES / "reference-contacts.csv", "--config", config, "--json")
    facts = json.loads(calibrate(*words))
    assert facts["made_for"]["rest_radius_mm"] == file.load(copy).radius.rest_radius_mm
    assert any(f"{copy}" in note for note in facts["notes"])
    config.write_text("[measurement]\n")
    assert json.loads(calibrate(*words))["made_for"]["rest_radius_mm"] == Balloon().rest_radius_mm


def test_a_new_file_contains_the_parts_of_the_configured_calibration(calibration_path, tmp_path):
    configured, out, config = (tmp_path / name for name in ("old.toml", "new.toml", "instrument.toml"))
    config.write_text('[measurement]\ncalibration = "old.toml"\n')
    calibrate("volume", EXAMPLES / "volume.csv", "--config", config, "--out", configured)
    calibrate("lag", EXAMPLES / "lag.csv", "--config", config, "--out", out)
    written = file.load(out)
    assert (len(written.parts), written.volume) == (2, file.load(configured).volume)
    shutil.copy(calibration_path, configured)
    output = calibrate("lag", EXAMPLES / "lag.csv", "--config", config, "--out", out)
    assert f"{configured}" in output
    assert len(file.load(out).parts) == 2


def test_a_contact_without_a_solution_is_skipped_and_its_line_is_named(tmp_path):
    table = (EXAMPLES / "reference-contacts.csv").read_text()
    some, few = tmp_path / "some.csv", tmp_path / "few.csv"
    some.write_text(f"{table}8.0,49.0,6.0,0.01\n5.0,45.0,5.0,0.01\n")
    lines = [len(table.splitlines()) + n for n in (1, 2)]
    facts, whole = (
        json.loads(calibrate("force", path, "--json")) for path in (some, EXAMPLES / "reference-contacts.csv")
    )
    assert (facts["points"], facts["constant"]) == (whole["points"], whole["constant"])
    assert any(f"{lines[0]}, {lines[1]}" in note for note in facts["notes"])
    few.write_text("\n".join([*table.splitlines()[:7], *["8.0,49.0,6.0,0.01"] * 9]))
    with pytest.raises(ConfigurationError, match=r"5 contacts, and at least 6 .*: 8, 9"):
        calibrate("force", few)


def test_a_new_radius_removes_the_force_calibration_with_a_note(calibration_path, tmp_path):
    copy = tmp_path / "calibration.toml"
    shutil.copy(calibration_path, copy)
    comment, header, *rows = (EXAMPLES / "radius.csv").read_text().splitlines()
    wider = [f"{kpa},{float(mm) + 0.1}" for kpa, mm in (row.split(",") for row in rows)]
    (tmp_path / "other.csv").write_text("\n".join([comment, header, *wider]))
    output = calibrate("radius", tmp_path / "other.csv", "--out", copy)
    assert "note: the old force calibration" in output
    assert file.load(copy).force is None
    assert file.load(copy).lag == file.load(calibration_path).lag


def test_an_unchanged_radius_keeps_the_force_calibration(calibration_path, tmp_path):
    copy = tmp_path / "calibration.toml"
    shutil.copy(calibration_path, copy)
    calibrate("radius", EXAMPLES / "radius.csv", "--out", copy)
    assert file.load(copy).force == file.load(calibration_path).force


@pytest.mark.parametrize("part", PARTS)
def test_the_json_output_is_the_part_that_would_be_written(calibration_path, part):
    output = json.loads(calibrate(part, EXAMPLES / PARTS[part], "--json"))
    assert output.pop("notes")[-1].startswith("nothing was written")
    assert ("residuals" in output) == (part == "force")
    output.pop("residuals", None)
    output = {name: value for name, value in output.items() if name not in KEYS}
    written = getattr(file.load(calibration_path), part).model_dump(mode="json")
    assert output.keys() == written.keys()
    if part != "force":
        assert output == written


def test_strokes_can_be_given_as_options():
    stroke = ["--displaced-ml", 1, "--before-kpa", 0, "--after-kpa", 8]
    output = json.loads(calibrate("volume", *stroke * 3, "--json"))
    assert output["volume_mm3"] == pytest.approx(1000 * 101.325 / 8)


def test_the_ambient_pressure_comes_from_the_configuration(tmp_path):
    config = tmp_path / "instrument.toml"
    config.write_text("[circuit]\nambient_kpa = 95.0\n")
    output = json.loads(calibrate("volume", EXAMPLES / "volume.csv", "--config", config, "--json"))
    assert output["ambient_kpa"] == 95.0


def test_a_calibration_belongs_to_the_balloon_of_its_configuration(calibration_path, tmp_path):
    config = tmp_path / "instrument.toml"
    config.write_text("[balloon]\nid = 3\n")
    out = tmp_path / "mine.toml"
    calibrate("lag", EXAMPLES / "lag.csv", "--config", config, "--out", out)
    assert file.load(out).balloon_id == 3
    with pytest.raises(ConfigurationError, match=r"balloon 0\b.* balloon\.id = 3\b.*--out"):
        calibrate("lag", EXAMPLES / "lag.csv", "--config", config, "--out", calibration_path)


def test_a_correction_that_is_no_better_than_the_law_is_not_written(tmp_path):
    """The references are the forces of the uncalibrated law, so that no correction can be better."""
    data, out = tmp_path / "contacts.csv", tmp_path / "calibration.toml"
    contacts = [(baseline, baseline + rise) for baseline in (5.5, 8.0, 10.5) for rise in (0.6, 1.8, 3.5)]
    forces = [estimate(*contact, Balloon(), Circuit(), LIVE_LAW).force_n for contact in contacts]
    rows = [f"{low},{high},{force}" for (low, high), force in zip(contacts, forces, strict=True)]
    data.write_text("\n".join(["baseline_kpa,final_kpa,force_n", *rows]))
    with pytest.raises(ConfigurationError, match=r"no calibration: .*; nothing was written"):
        calibrate("force", data, "--out", out)
    assert not out.exists()


def scaled(source, columns, factor, target):
    """Write a CSV file in which the values of some columns are multiplied by a factor."""
    lines = (EXAMPLES / source).read_text().splitlines()
    header, *rows = (line.split(",") for line in lines if not line.startswith("#"))
    wrong = [
        [
            str(float(cell) * factor) if name in columns else cell
            for name, cell in zip(header, row, strict=True)
        ]
        for row in rows
    ]
    target.write_text("\n".join(",".join(cells) for cells in [header, *wrong]))
    return target


@pytest.mark.parametrize(
    ("part", "source", "columns", "factor"),
    [
        ("radius", "radius.csv", ["diameter_mm"], 2.0),
        ("radius", "radius.csv", ["diameter_mm"], 0.5),
        ("radius", "radius.csv", ["pressure_kpa"], 0.145),
        ("volume", "volume.csv", ["syringe_ml", "volume_mm3"], 10.0),
        ("volume", "volume.csv", ["syringe_ml", "volume_mm3"], 0.01),
        ("force", "reference-contacts.csv", ["force_n", "force_std_n"], 1000.0),
        ("force", "reference-contacts.csv", ["force_n", "force_std_n"], 4.448),
        ("force", "reference-contacts.csv", ["force_n", "force_std_n"], 0.102),
    ],
)
def test_measurements_that_are_not_plausible_give_no_calibration(tmp_path, part, source, columns, factor):
    data, out = scaled(source, columns, factor, tmp_path / source), tmp_path / "calibration.toml"
    with pytest.raises(ConfigurationError) as raised:
        calibrate(part, data, "--out", out)
    assert str(raised.value).startswith(str(data))
    assert not out.exists()


def test_an_implausible_force_in_a_file_is_replaced_by_a_new_force_calibration(calibration_path, tmp_path):
    out = tmp_path / "calibration.toml"
    text = calibration_path.read_text()
    out.write_text(re.sub(r"^constant = .*$", "constant = -3.0", text, flags=re.M))
    with pytest.raises(ConfigurationError) as raised:
        calibrate("lag", EXAMPLES / "lag.csv", "--out", out)
    assert str(raised.value).startswith(str(out))
    calibrate("force", EXAMPLES / "reference-contacts.csv", "--out", out)
    assert file.load(out).force.constant == file.load(calibration_path).force.constant


def test_config_check_refuses_an_implausible_calibration_with_exit_code_2(calibration_path, tmp_path):
    text = calibration_path.read_text()
    (tmp_path / "calibration.toml").write_text(
        re.sub(r"^constant = .*$", "constant = -3.0", text, flags=re.M)
    )
    config = tmp_path / "instrument.toml"
    config.write_text('[measurement]\ncalibration = "calibration.toml"\n')
    for words in (["config", "--check", str(config)], ["run", "--config", str(config)]):
        done = pneuforce(*words, cwd=ROOT)
        assert done.returncode == 78
        assert str(tmp_path / "calibration.toml") in done.stderr
        assert len(done.stderr.strip().splitlines()) == 1


def test_an_incomplete_calibration_file_is_rejected_and_not_changed(tmp_path):
    out = tmp_path / "calibration.toml"
    out.write_text("version = 1\n")
    with pytest.raises(ConfigurationError, match="no complete calibration file"):
        calibrate("lag", EXAMPLES / "lag.csv", "--out", out)
    assert out.read_text() == "version = 1\n"


def test_the_same_seed_gives_the_same_contacts():
    first, second, other = (calibrate("contacts", "--count", 2, "--seed", seed) for seed in (5, 5, 6))
    assert first == second != other
    assert first.splitlines()[0] == "baseline_kpa,final_kpa,force_n,force_std_n"
    assert len(first.splitlines()) == 3


def test_a_note_warns_of_the_inflation_limit_of_the_balloon():
    output = json.loads(calibrate("radius", EXAMPLES / "radius.csv", "--json"))
    warned = any("inflation limit" in note for note in output["notes"])
    assert warned == (0.9 * output["limit_kpa"] < 12)


def test_the_calibrated_instrument_measures_a_rubber_balloon_within_its_stated_uncertainty(tmp_path):
    calibrate("force", EXAMPLES / "reference-contacts.csv", "--out", tmp_path / "calibration.toml")
    (tmp_path / "instrument.toml").write_text('[measurement]\ncalibration = "calibration.toml"\n')
    forces_n = (0.5, 1.2, 2.0, 3.2)
    press = {"kind": "press", "force_n": list(forces_n), "hold_s": 1.0}
    phases = [{"setpoint_kpa": [5.6, 8.3, 10.6], "contact": [press]}]
    scenario = Scenario.model_validate(
        {"doc": "new contacts", "plant": {"kind": "membrane"}, "phase": phases}
    )
    chain = load(tmp_path / "instrument.toml").chain
    plateaus = [
        (m.force_n, m.force_std_n, truth_n)
        for truth_n, same in groupby(
            measure_playback(Playback(scenario), chain), key=lambda pair: pair[1].force_n
        )
        for m, _ in list(same)[400:401]
        if truth_n > 0
    ]
    assert [truth_n for *_, truth_n in plateaus] == pytest.approx(forces_n * 3)
    assert all(abs(force_n - truth_n) < 2 * std_n for force_n, std_n, truth_n in plateaus)
    errors = [abs(force_n / truth_n - 1) for force_n, _, truth_n in plateaus if truth_n >= 1]
    assert sum(errors) / len(errors) <= 0.05


def contact_table(path, contacts):
    rows = zip(
        contacts.baseline_kpa, contacts.baseline_kpa + contacts.rise_kpa, contacts.force_n, strict=True
    )
    lines = [",".join(f"{value:.5f}" for value in row) for row in rows]
    path.write_text("\n".join(["baseline_kpa,final_kpa,force_n", *lines]) + "\n")
    return path


def test_the_uncertainty_covers_the_error_where_no_contact_was_calibrated(tmp_path):
    """The contacts of the calibration end at 8 kPa. The correction is not known at higher pressures."""
    plant, settings = "Mooney-Rivlin, 1 side", ChainSettings()
    low = contact_table(
        tmp_path / "low.csv", plant_contacts(plant, settings, seed=1, setpoints_kpa=(5.05, 8.0))
    )
    output = calibrate("force", low, "--out", tmp_path / "calibration.toml")
    assert re.search(r"7\.55–8\.85 \(but 7\.55–7\.9\d\), 8\.85–10\.15, 10\.15–11\.45", output)
    (tmp_path / "instrument.toml").write_text('[measurement]\ncalibration = "calibration.toml"\n')
    high = plant_contacts(plant, settings, seed=2, count=60, setpoints_kpa=(8.9, 11.4), forces_n=(0.8, 3.5))
    table = contact_table(tmp_path / "high.csv", high)
    words = ("estimate", "--csv", table, "--config", tmp_path / "instrument.toml", "--json")
    rows = json.loads(pneuforce(*words).stdout)["contacts"]
    within = [
        abs(row["force_n"] - truth_n) <= 2 * row["force_std_n"]
        for row, truth_n in zip(rows, high.force_n, strict=True)
    ]
    assert sum(within) >= 0.95 * len(within)


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("radius", "absent.csv"), "absent.csv: no such file"),
        (("radius", "docs/examples/volume.csv"), "the first line must name the columns pressure_kpa"),
        (("volume",), "--displaced-ml, --before-kpa and --after-kpa"),
        (("lag", "docs"), "docs: cannot be read: it is a folder"),
        (("lag", "/dev/zero"), "/dev/zero: cannot be read: not a regular file"),
        (("lag", "docs/examples/lag.csv", "--out", "/dev/full"), "/dev/full: cannot be written"),
        (("volume", *["--displaced-ml", "1e308", "--before-kpa", "0", "--after-kpa", "8"]), "numbers up to"),
    ],
)  # fmt: skip
def test_an_error_is_one_line_with_exit_code_2(words, expected):
    done = pneuforce("calibrate", *words, cwd=ROOT)
    assert done.returncode == 2
    assert expected in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def test_every_part_in_the_file_has_its_source_and_a_hash(calibration_path):
    tables = tomllib.loads(calibration_path.read_text())
    for part, name in PARTS.items():
        assert tables[part]["source"].endswith(name)
        assert len(tables[part]["source_sha256"]) == 64
