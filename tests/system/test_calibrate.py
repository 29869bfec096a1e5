"""pneuforce calibrate from end to end: the documented examples in, one file out, and an instrument of it."""

import json
import re
import shutil
import tomllib
from itertools import groupby
from pathlib import Path

import pytest
from typer.testing import CliRunner

from instrument.calibration import file
from instrument.cli.app import app
from instrument.cli.measured_scenario import measured
from instrument.config import load
from instrument.errors import ConfigurationError
from sim.headless import Playback
from sim.scenario import Scenario
from tests.typed import pneuforce

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "docs/examples"
PARTS = {"radius": "radius.csv", "volume": "volume.csv", "lag": "lag.csv", "force": "contacts.csv"}


COMMANDS = [
    line.removeprefix(".venv/bin/pneuforce calibrate ").split()
    for block in re.findall(r"```sh\n(.*?)```", (ROOT / "docs/calibration.md").read_text(), re.S)
    for line in block.splitlines()
]


def calibrate(*words):
    """What it prints; raises what the command line would say in one sentence."""
    done = CliRunner().invoke(app, ["calibrate", *map(str, words)])
    if done.exception and not isinstance(done.exception, SystemExit):
        raise done.exception
    assert done.exit_code == 0, done.output
    return done.stdout


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    path = tmp_path_factory.mktemp("calibration") / "calibration.toml"
    for part, name in PARTS.items():
        calibrate(part, EXAMPLES / name, "--out", path)
    return path


def test_the_documents_commands_do_what_the_document_shows(tmp_path, monkeypatch):
    (tmp_path / "docs").symlink_to(ROOT / "docs")
    monkeypatch.chdir(tmp_path)
    assert len(COMMANDS) == 6
    for words in COMMANDS:
        words, _, redirected = " ".join(words).partition(" > ")
        told = calibrate(*words.split())
        if redirected:
            comment, header, *rows = (EXAMPLES / redirected).read_text().splitlines()
            assert "--plant membrane --count 24 --seed 1" in comment
            assert (told.splitlines()[0], len(told.splitlines())) == (header, 1 + len(rows))
    assert len(file.load(tmp_path / "calibration.toml").parts) == 4


def test_each_part_is_added_to_the_others_in_one_file(made):
    calibration = file.load(made)
    assert len(calibration.parts) == 4
    assert calibration.volume.volume_mm3 == pytest.approx(12_680, abs=2 * calibration.volume.volume_std_mm3)
    assert calibration.lag.tube_s == pytest.approx(0.06, abs=0.001)
    assert calibration.radius.rest_radius_mm == pytest.approx(7.503, abs=0.05)


def test_the_force_was_calibrated_on_the_measured_radius_and_volume(made):
    calibration = file.load(made)
    assert calibration.force.made_for.rest_radius_mm == calibration.radius.rest_radius_mm
    assert calibration.force.made_for.volume_mm3 == calibration.volume.volume_mm3
    assert calibration.force.after_unseen.mean_error_percent < 5 < calibration.force.before.mean_error_percent


def test_an_instrument_takes_the_file_as_it_is(made):
    (made.parent / "instrument.toml").write_text('[measurement]\ncalibration = "calibration.toml"\n')
    settings = load(made.parent / "instrument.toml").settings()
    assert settings.chain.correction is not None
    assert settings.identity.calibration_date == file.load(made).date_code


def test_a_new_radius_drops_the_force_that_was_made_with_the_old_one_and_says_so(made, tmp_path):
    again = tmp_path / "calibration.toml"
    shutil.copy(made, again)
    comment, header, *rows = (EXAMPLES / "radius.csv").read_text().splitlines()
    wider = [f"{kpa},{float(mm) + 0.1}" for kpa, mm in (row.split(",") for row in rows)]
    (tmp_path / "other.csv").write_text("\n".join([comment, header, *wider]))
    said = calibrate("radius", tmp_path / "other.csv", "--out", again)
    assert "the force calibration in this file was made with the old value, and is dropped" in said
    assert file.load(again).force is None
    assert file.load(again).lag == file.load(made).lag


def test_the_same_radius_again_keeps_the_force(made, tmp_path):
    again = tmp_path / "calibration.toml"
    shutil.copy(made, again)
    calibrate("radius", EXAMPLES / "radius.csv", "--out", again)
    assert file.load(again).force == file.load(made).force


@pytest.mark.parametrize("part", PARTS)
def test_as_json_it_is_the_part_that_would_be_written(made, part):
    told = json.loads(calibrate(part, EXAMPLES / PARTS[part], "--json"))
    assert told.pop("notes")[-1].startswith("nothing was written")
    written = getattr(file.load(made), part).model_dump(mode="json")
    assert told.keys() == written.keys()
    if part != "force":
        assert told == written


def test_strokes_may_be_typed():
    stroke = ["--displaced-ml", 1, "--before-kpa", 0, "--after-kpa", 8]
    told = json.loads(calibrate("volume", *stroke * 3, "--json"))
    assert told["volume_mm3"] == pytest.approx(1000 * 101.325 / 8)


def test_the_ambient_pressure_is_the_configurations(tmp_path):
    config = tmp_path / "instrument.toml"
    config.write_text("[circuit]\nambient_kpa = 95.0\n")
    told = json.loads(calibrate("volume", EXAMPLES / "volume.csv", "--config", config, "--json"))
    assert told["ambient_kpa"] == 95.0


def test_a_calibration_goes_with_the_balloon_of_its_configuration(made, tmp_path):
    config = tmp_path / "instrument.toml"
    config.write_text("[balloon]\nid = 3\n")
    out = tmp_path / "mine.toml"
    calibrate("lag", EXAMPLES / "lag.csv", "--config", config, "--out", out)
    assert file.load(out).balloon_id == 3
    with pytest.raises(ConfigurationError, match=r"balloon\.id = 3, and the calibration is of balloon 0"):
        calibrate("lag", EXAMPLES / "lag.csv", "--config", config, "--out", made)


def test_contacts_that_no_correction_helps_write_nothing(tmp_path):
    data, out = tmp_path / "contacts.csv", tmp_path / "calibration.toml"
    data.write_text(calibrate("contacts", "--plant", "published", "--count", 6, "--seed", 1))
    with pytest.raises(ConfigurationError, match=r"no calibration: .*; nothing was written"):
        calibrate("force", data, "--out", out)
    assert not out.exists()


def test_a_spoilt_calibration_file_is_refused_and_left_alone(tmp_path):
    out = tmp_path / "calibration.toml"
    out.write_text("version = 1\n")
    with pytest.raises(ConfigurationError, match="cut short"):
        calibrate("lag", EXAMPLES / "lag.csv", "--out", out)
    assert out.read_text() == "version = 1\n"


def test_the_same_seed_makes_the_same_contacts():
    once, again, other = (calibrate("contacts", "--count", 2, "--seed", seed) for seed in (5, 5, 6))
    assert once == again != other
    assert once.splitlines()[0] == "initial_kpa,final_kpa,force_n,force_std_n"
    assert len(once.splitlines()) == 3


def test_the_limit_of_the_balloon_is_warned_of():
    told = json.loads(calibrate("radius", EXAMPLES / "radius.csv", "--json"))
    warned = any("inflation limit" in note for note in told["notes"])
    assert warned == (0.9 * told["limit_kpa"] < 12)


def test_the_calibrated_instrument_measures_a_rubber_balloon_within_its_stated_uncertainty(tmp_path):
    calibrate("force", EXAMPLES / "contacts.csv", "--out", tmp_path / "calibration.toml")
    (tmp_path / "instrument.toml").write_text('[measurement]\ncalibration = "calibration.toml"\n')
    forces_n = (0.5, 1.2, 2.0, 3.2)
    press = {"kind": "press", "force_n": list(forces_n), "hold_s": 1.0}
    phases = [{"setpoint_kpa": [5.6, 8.3, 10.6], "contact": [press]}]
    scenario = Scenario.model_validate({"doc": "fresh", "plant": {"kind": "membrane"}, "phase": phases})
    chain = load(tmp_path / "instrument.toml").chain
    plateaus = [
        (m.force_n, m.force_std_n, truth_n)
        for truth_n, same in groupby(measured(Playback(scenario), chain), key=lambda pair: pair[1].force_n)
        for m, _ in list(same)[400:401]
        if truth_n > 0
    ]
    assert [truth_n for *_, truth_n in plateaus] == pytest.approx(forces_n * 3)
    assert all(abs(force_n - truth_n) < 2 * std_n for force_n, std_n, truth_n in plateaus)
    errors = [abs(force_n / truth_n - 1) for force_n, _, truth_n in plateaus if truth_n >= 1]
    assert sum(errors) / len(errors) <= 0.05


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("radius", "absent.csv"), "absent.csv: no such file"),
        (("radius", "docs/examples/volume.csv"), "the first line must name the columns pressure_kpa"),
        (("volume",), "give either a CSV file, or --displaced-ml"),
        (("lag", "docs"), "docs: cannot be read: not a regular file"),
        (("lag", "/dev/zero"), "/dev/zero: cannot be read: not a regular file"),
        (("lag", "docs/examples/lag.csv", "--out", "/dev/full"), "/dev/full: cannot be written"),
        (("volume", *["--displaced-ml", "1e308", "--before-kpa", "0", "--after-kpa", "8"]), "numbers up to"),
    ],
)  # fmt: skip
def test_a_refusal_is_one_sentence_and_exit_code_2(words, said):
    done = pneuforce("calibrate", *words, cwd=ROOT)
    assert done.returncode == 2
    assert said in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def test_every_part_says_in_toml_when_and_of_what_it_was_made(made):
    tables = tomllib.loads(made.read_text())
    for part, name in PARTS.items():
        assert tables[part]["source"].endswith(name)
        assert len(tables[part]["source_sha256"]) == 64
