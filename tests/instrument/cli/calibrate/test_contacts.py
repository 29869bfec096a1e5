"""Tests of `pneuforce calibrate contacts --from`: contacts of a recording with the force of a reference."""

import csv
import json
import random
import re

import pytest

from pneuforce.instrument.cli.calibrate.contacts import PairingInput, pair
from pneuforce.instrument.recording.opening import open_recording
from pneuforce.instrument.validation.reference import ReferenceColumns
from pneuforce.instrument.validation.reference_alignment import ReferenceInput
from tests.command_runner import pneuforce
from tests.instrument.recording.recorded_scenario import record_scenario

FORCES_N = ((0.6, 2.6, 1.4, 3.2), (1.1, 2.0, 0.8, 2.9))
SCENARIO = """
doc = "Four contacts at each of two pressures, one of them short, at irregular times."

[plant]
kind = "membrane"
"""
PHASE = """
[[phase]]
setpoint_kpa = [{setpoint_kpa}]
"""
CONTACT = """
[[phase.contact]]
kind = "press"
force_n = [{force_n}]
hold_s = {hold_s}
pause_s = {pause_s}
"""
OFFSET_S = 1234.567  #: the clock of the reference is behind the clock of the recording
ZERO_N, NOISE_N = 0.08, 0.01


def scenario():
    rng, text = random.Random(7), SCENARIO
    for setpoint_kpa, forces_n in zip((6.5, 9.5), FORCES_N, strict=True):
        text += PHASE.format(setpoint_kpa=setpoint_kpa)
        for force_n in forces_n:
            text += CONTACT.format(
                force_n=force_n,
                hold_s=0.2 if force_n == 0.8 else 1.0,
                pause_s=round(rng.uniform(0.8, 2.0), 2),
            )
    return text


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return a folder with a recording, and with a reference that has its own clock, zero, unit and names."""
    folder, rng = tmp_path_factory.mktemp("simulated"), random.Random(1)
    readings = record_scenario(folder, scenario())
    rows = [
        f"{t_s - OFFSET_S:.4f},{1e3 * (force_n + ZERO_N + rng.gauss(0.0, NOISE_N)):.2f}\n"
        for t_s, force_n in readings
    ]
    (folder / "logger.csv").write_text("".join(["time,load\n", *rows]))
    return folder


LOGGER = ("--time-column", "time", "--force-column", "load", "--unit", "mN", "--tare")


def paired(folder, *words):
    done = pneuforce("calibrate", "contacts", "--from", folder / "a.recording", *words, "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_the_offset_is_estimated_and_each_plateau_has_its_force(folder):
    found = paired(folder, "--reference", folder / "logger.csv", *LOGGER)
    assert found["offset_s"] == pytest.approx(OFFSET_S, abs=0.03)
    assert found["free_force_n"] == pytest.approx(ZERO_N, abs=0.01)
    held_n = [force_n for forces_n in FORCES_N for force_n in forces_n if force_n != 0.8]
    assert [row["force_n"] for row in found["paired"]] == pytest.approx(held_n, abs=0.02)
    assert [row["baseline_kpa"] for row in found["paired"]] == pytest.approx([6.5] * 4 + [9.5] * 3, abs=0.15)
    assert all(row["force_std_n"] == pytest.approx(NOISE_N, rel=0.5) for row in found["paired"])
    [short] = found["unpaired"]
    assert short["reason"]


def test_the_table_is_accepted_by_calibrate_force(folder, tmp_path):
    out = tmp_path / "contacts.csv"
    words = ("--from", folder / "a.recording", "--reference", folder / "logger.csv", *LOGGER, "--out", out)
    done = pneuforce("calibrate", "contacts", *words)
    assert done.returncode == 0, done.stderr
    assert "7 of 8" in done.stdout
    rows = list(csv.DictReader(line for line in out.read_text().splitlines() if not line.startswith("#")))
    assert len(rows) == 7
    residuals = tmp_path / "residuals.csv"
    calibrated = pneuforce("calibrate", "force", out, "--json", "--residuals", residuals)
    assert calibrated.returncode == 0, calibrated.stderr
    with open_recording(folder / "a.recording") as source:
        begin_utc_s = source.begin_utc_s
    assert json.loads(calibrated.stdout)["recordings_utc_s"] == [pytest.approx(begin_utc_s, abs=1e-4)]
    rows = list(csv.DictReader(residuals.read_text().splitlines()))
    assert [float(row["difference_n"]) for row in rows] == [
        row["difference_n"] for row in json.loads(calibrated.stdout)["residuals"]
    ]
    refused = pneuforce("calibrate", "force", out, "--residuals", residuals)
    assert (refused.returncode, "--overwrite" in refused.stderr) == (2, True)
    refused = pneuforce("calibrate", "contacts", *words)
    assert (refused.returncode, "--overwrite" in refused.stderr) == (2, True)


def test_a_damaged_recording_gives_its_contacts_and_an_exit_code(folder, tmp_path):
    whole = (folder / "a.recording").read_bytes()
    (tmp_path / "cut.recording").write_bytes(whole[: len(whole) * 9 // 10])
    words = ("--from", tmp_path / "cut.recording", "--reference", folder / "cell.csv", "--offset", "0")
    done = pneuforce("calibrate", "contacts", *words, "--json")
    found = json.loads(done.stdout)
    assert found["paired"]
    assert "damaged" in found["remark"]
    assert done.returncode == 1
    (tmp_path / "cut.recording").write_bytes(whole[: len(whole) // 20])
    rejected = pneuforce("calibrate", "contacts", *words)
    assert (rejected.returncode, rejected.stderr.count("cut.recording")) == (2, 1)


def validation_rows(folder, out, *words):
    """Export the recording with a reference force. Return the output, and time and force of each sample."""
    options = ("--format", "validation", "--reference", *words)
    done = pneuforce("export", folder / "a.recording", out, *options)
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader(out.read_text().splitlines()))
    assert f": {len(rows)} samples" in done.stdout
    return done.stdout, {float(row["t_s"]): float(row["force_n"]) for row in rows}


def test_export_and_plot_align_the_reference_in_the_same_way(folder, tmp_path):
    _, truth = validation_rows(folder, tmp_path / "a.csv", folder / "cell.csv", "--offset", "0")
    output, aligned = validation_rows(folder, tmp_path / "b.csv", folder / "logger.csv", *LOGGER)
    common = truth.keys() & aligned.keys()
    cut = tmp_path / "cut.csv"
    cut.write_text("".join((folder / "cell.csv").read_text().splitlines(keepends=True)[:1001]))
    _, shorter = validation_rows(folder, tmp_path / "c.csv", cut, "--offset", "0")
    assert 0 < len(shorter) < len(truth)
    assert len(common) > 0.95 * len(truth) > 1000
    errors_n = sorted(abs(aligned[t_s] - truth[t_s]) for t_s in common)
    assert errors_n[len(errors_n) * 9 // 10] < 0.03
    offset_s = float(re.search(r"clock offset: (\S+) s", output)[1])
    assert offset_s == pytest.approx(OFFSET_S, abs=0.03)
    words = ("--by-pressure", "--reference", folder / "logger.csv", *LOGGER)
    plotted = pneuforce("plot", folder / "a.recording", tmp_path / "errors.png", *words)
    assert plotted.returncode == 0, plotted.stderr
    assert plotted.stdout.splitlines()[1:] == output.splitlines()[1:]


def test_only_the_contacts_of_a_part_of_the_recording_are_paired(folder):
    words = ("--reference", folder / "logger.csv", *LOGGER)
    rows = paired(folder, *words)["paired"]
    first_s, last_s = rows[2]["plateau_begin_s"] - 1.0, rows[4]["plateau_begin_s"] + 2.0
    part = paired(folder, *words, "--from-s", str(first_s), "--to-s", str(last_s))["paired"]
    assert [row["contact"] for row in part] == [row["contact"] for row in rows[2:5]]
    assert pneuforce("calibrate", "contacts", "--from-s", "1").returncode == 2


def test_a_probably_wrong_unit_or_offset_has_an_exit_code(folder, tmp_path):
    words = ("--from", folder / "a.recording", "--reference", folder / "cell.csv")
    for number, wrong in enumerate((("--unit", "g"), ("--offset", "0.4"))):
        out = tmp_path / f"{number}.csv"
        done = pneuforce("calibrate", "contacts", *words, *wrong, "--out", out, "--json")
        assert done.returncode == 1
        assert json.loads(done.stdout)["warnings"]


def test_an_option_of_the_reference_needs_a_reference(folder, tmp_path):
    for words in (("export", folder / "a.recording", tmp_path / "a.csv"), ("plot", folder / "a.recording")):
        rejected = pneuforce(*words, "--tare", "--unit", "mN")
        assert rejected.returncode == 2
        assert "--unit, --tare can be used only with --reference" in rejected.stderr


def test_a_given_offset_is_used_and_a_wrong_offset_gives_no_wrong_force(folder):
    def paired_at(offset_s):
        reference = ReferenceInput(folder / "cell.csv", offset_s=offset_s)
        return pair(PairingInput(folder / "a.recording", reference))

    right = paired_at(0.0)
    truths_n = {plateau.contact: plateau.force_n for plateau in right.paired}
    assert len(truths_n) == 7
    for offset_s in (-0.4, -0.2, 0.2, 0.4):
        for plateau in paired_at(offset_s).paired:
            assert plateau.force_n == pytest.approx(truths_n[plateau.contact], rel=0.03)


def test_the_offset_of_two_utc_clocks_follows_from_the_start_of_the_recording(folder, tmp_path):
    with open_recording(folder / "a.recording") as source:
        begin_utc_s = source.begin_utc_s
    late_s = 0.12
    rows = csv.DictReader((folder / "cell.csv").read_text().splitlines())
    lines = [f"{float(row['t_s']) + begin_utc_s + late_s:.4f},{row['force_n']}\n" for row in rows]
    reference = tmp_path / "utc.csv"
    reference.write_text("".join(["utc_s,force_n\n", *lines]))
    words = ("--reference", reference, "--time-column", "utc_s")
    found = paired(folder, *words, "--offset", "utc")
    assert found["offset_given"]
    assert found["offset_s"] == pytest.approx(-begin_utc_s, abs=1e-3)
    assert paired(folder, *words)["offset_s"] == pytest.approx(-begin_utc_s - late_s, abs=0.03)
    for words, reason in (
        (("--reference", folder / "cell.csv", "--offset", "utc"), "--time-column"),
        (("--reference", reference, "--offset", "UTC+1"), "UTC+1"),
        (("--reference", reference, "--offset", "nan"), "--offset"),
    ):
        rejected = pneuforce("calibrate", "contacts", "--from", folder / "a.recording", *words)
        assert (rejected.returncode, rejected.stdout) == (2, "")
        assert reason in rejected.stderr


def warnings_of(folder, **options):
    reference = ReferenceInput(folder / "cell.csv", **options)
    return pair(PairingInput(folder / "a.recording", reference)).aligned.warnings


def test_a_wrong_offset_unit_or_sign_gives_a_warning(folder):
    assert warnings_of(folder) == warnings_of(folder, offset_s=0.0) == ()
    for offset_s in (-3.0, 0.4, 1e4):
        [warning] = warnings_of(folder, offset_s=offset_s)
        assert "--offset" in warning
    [warning] = warnings_of(folder, offset_s=0.0, columns=ReferenceColumns(inverted=True))
    assert "--invert" in warning
    for unit in ("mN", "gf", "g", "kgf", "lbf"):
        [warning] = warnings_of(folder, columns=ReferenceColumns(unit=unit))
        assert "--unit N" in warning


def test_a_wrong_clock_rate_gives_a_warning(folder, tmp_path):
    rows = csv.DictReader((folder / "cell.csv").read_text().splitlines())
    lines = [f"{float(row['t_s']) / 1.01:.4f},{row['force_n']}\n" for row in rows]
    (tmp_path / "cell.csv").write_text("".join(["t_s,force_n\n", *lines]))
    reference = ReferenceInput(tmp_path / "cell.csv")
    [warning] = pair(PairingInput(folder / "a.recording", reference)).aligned.warnings
    assert float(re.search(r"Multiply .* by (\d\.\d+)", warning)[1]) == pytest.approx(1.01, abs=1e-3)


def test_a_forgotten_tare_gives_a_warning_and_no_calibration(folder, tmp_path):
    words = ("--from", folder / "a.recording", "--reference", folder / "logger.csv", *LOGGER[:-1])
    done = pneuforce("calibrate", "contacts", *words, "--out", tmp_path / "contacts.csv")
    assert done.returncode == 0, done.stderr
    assert "--tare" in done.stdout
    rejected = pneuforce("calibrate", "force", tmp_path / "contacts.csv")
    assert rejected.returncode == 2
    assert "--tare" in rejected.stderr


def test_a_reference_that_fits_nowhere_or_at_several_times_is_rejected(folder, tmp_path):
    rng = random.Random(3)
    (tmp_path / "noise.csv").write_text(
        "t_s,force_n\n" + "".join(f"{n / 100:.2f},{rng.random():.3f}\n" for n in range(4000))
    )
    words = ("calibrate", "contacts", "--from", folder / "a.recording", "--reference")
    unlike = pneuforce(*words, tmp_path / "noise.csv")
    assert (unlike.returncode, "--offset" in unlike.stderr) == (2, True)
    constant = tmp_path / "constant.csv"
    constant.write_text("t_s,force_n\n" + "".join(f"{n / 100:.2f},0.5\n" for n in range(4000)))
    assert pneuforce(*words, constant).returncode == 2
    early = tmp_path / "early.csv"
    early.write_text("t_s,force_n\n0,0\n0.1,0\n")
    none = pneuforce(*words, early, "--offset", "0", "--out", tmp_path / "none.csv")
    assert none.returncode == 1
    assert not (tmp_path / "none.csv").exists()
    none = pneuforce(*words, early, "--offset", "0")
    assert (none.returncode, none.stdout) == (1, "")
    assert none.stderr.count("is not paired") == 8


def test_options_of_the_simulation_and_of_a_recording_are_not_mixed(folder):
    recording = ("--from", folder / "a.recording")
    for words in (
        recording,
        (*recording, "--reference", folder / "cell.csv", "--seed", "1"),
        ("--offset", "1"),
        ("--reference", folder / "cell.csv"),
        (*recording, "--reference", folder / "cell.csv", "--force-column", "load"),
    ):
        rejected = pneuforce("calibrate", "contacts", *words)
        assert (rejected.returncode, rejected.stdout) == (2, "")
        assert len(rejected.stderr.splitlines()) == 1
