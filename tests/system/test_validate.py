"""Tests of `pneuforce validate`: a short campaign, its recording, its figures, and rejected options."""

import json
import sys
from pathlib import Path

import pytest

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.validation.figures import prepare_folder
from tests.command_runner import pneuforce
from tests.instrument.validation.synthetic_trials import force_n, trial

ROOT = Path(__file__).parents[2]
SCENARIO = ROOT / "docs/examples/three-pressures.toml"
EXAMPLE = ROOT / "docs/examples/validation-recording.csv"
FIGURES = {"fig4-radius", "fig6a-slow", "fig6b-fast", "fig6c-continuous", "fig7-errors", "law"}
ERRORS = {"solved": int, "absolute": (float, type(None)), "signed": (float, type(None))}


def validate(*arguments):
    return pneuforce("validate", *arguments)


def error_line(*arguments):
    """Return the single line that the command prints to stderr before it exits with code 2."""
    done = validate(*arguments)
    assert (done.returncode, done.stdout) == (2, "")
    assert len(done.stderr.strip().splitlines()) == 1, done.stderr
    return done.stderr


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    """Return the report of a short campaign, and the folder with the files that the campaign wrote."""
    folder = tmp_path_factory.mktemp("campaign")
    written = ("--save", folder / "rig.csv", "--figures", folder / "figures")
    done = validate("--scenario", SCENARIO, "--plant", "published", "--seed", "7", "--json", *written)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""  # there is no progress bar without a terminal
    return json.loads(done.stdout), folder


def test_the_report_contains_the_simulation_and_the_counts_of_contacts(campaign):
    report, _ = campaign
    source, contacts = report["source"], report["contacts"]
    assert (source["plant"], source["seed"], source["contacts"]) == ("published", 7, 9)
    assert source["completed"] is True
    assert (report["trials"], contacts["found"]) == (3, 9)
    # On the published balloon, 1.6 N at 10.5 kPa raises the pressure by less than 0.5 kPa.
    assert (contacts["evaluated"], contacts["too_small"]) == (8, 1)
    assert report["law"] == {"method": "energetic", "switch": "paper", "low": "line"}


def test_every_group_has_every_method_beside_the_published_error(campaign):
    groups = {group["group"]: group for group in campaign[0]["peak_errors_percent"]}
    assert len(groups) == 9
    for group in groups.values():
        for method in ("energetic", "lulevich", "shanahan"):
            for key, kind in ERRORS.items():
                assert isinstance(group[method][key], kind), (group["group"], method, key)
    assert groups["all contacts"]["energetic"]["paper"] == 9.14
    assert groups["6.25–7.55 kPa"]["count"] == 0
    assert groups["6.25–7.55 kPa"]["energetic"]["absolute"] is None


def test_on_a_balloon_that_follows_the_law_the_error_is_below_one_percent(campaign):
    [all_contacts, *_] = campaign[0]["peak_errors_percent"]
    assert all_contacts["energetic"]["absolute"] < 1.0
    assert all_contacts["lulevich"]["absolute"] > 5.0


def test_live_compensation_is_better_than_a_shift_found_afterwards(campaign):
    continuous = campaign[0]["continuous"]
    assert continuous["compensated_n"] < continuous["shifted_n"] < continuous["uncompensated_n"]
    assert 0.09 < continuous["shift_s"] < 0.15
    assert (continuous["paper_n"], continuous["paper_shift_s"]) == (0.578, 0.12)


def approximately(value):
    """Return the value with pytest.approx for each number, also in nested objects and lists."""
    if isinstance(value, dict):
        return {key: approximately(item) for key, item in value.items()}
    if isinstance(value, list):
        return [approximately(item) for item in value]
    return pytest.approx(value, abs=2e-3, rel=1e-3) if isinstance(value, float) else value


def test_the_saved_recording_gives_the_same_report(campaign):
    report, folder = campaign
    again = json.loads(validate("--data", folder / "rig.csv", "--json").stdout)
    for key in ("trials", "contacts", "peak_errors_percent", "volume_change", "continuous"):
        assert again[key] == approximately(report[key]), key


def test_the_figures_are_drawn_in_both_formats(campaign):
    folder = campaign[1] / "figures"
    assert {file.name for file in folder.iterdir()} == {f"{n}.{f}" for n in FIGURES for f in ("png", "svg")}
    for file in folder.iterdir():
        signature = b"\x89PNG" if file.suffix == ".png" else b"<?xml"
        assert file.read_bytes().startswith(signature)
        assert 5_000 < file.stat().st_size < 100_000


def test_the_example_recording_is_validated_in_a_table_that_fits_a_terminal(tmp_path):
    done = validate("--data", EXAMPLE, "--figures", tmp_path)
    assert done.returncode == 0, done.stderr
    assert "9 contacts in 3 trials" in done.stdout
    assert "…" not in done.stdout
    assert max(map(len, done.stdout.splitlines())) <= 80
    assert {file.stem for file in tmp_path.iterdir()} == FIGURES - {"fig4-radius", "fig6b-fast"}


def test_the_smooth_low_end_changes_the_continuous_force_and_no_peak():
    default, smooth = (
        json.loads(validate("--data", EXAMPLE, "--json", *law).stdout) for law in ((), ("--low", "smooth"))
    )
    assert smooth["law"] == {"method": "energetic", "switch": "paper", "low": "smooth"}
    assert smooth["peak_errors_percent"] == default["peak_errors_percent"]
    assert smooth["continuous"]["compensated_n"] != default["continuous"]["compensated_n"]


@pytest.mark.parametrize(
    ("arguments", "facts"),
    [
        (("--data", EXAMPLE, "--seed", "3"), ["--data", "--scenario", "--plant", "--seed"]),
        (("--data", EXAMPLE, "--contact", "stick"), ["--data", "--contact"]),
        (("--plant", "published", "--rubber", "gent"), ["--rubber", "--plant membrane"]),
        (("--plant", "membrane", "--contact", "glue"), ["'glue'", "slide", "stick", "0", "1"]),
        (("--plant", "membrane", "--contact", "nan"), ["nan", "slide", "stick", "0", "1"]),
        (("--data", EXAMPLE, "--save", "/tmp/never.csv"), ["--save", "--data"]),
        (("--scenario", "nothing"), ["scenario", "'nothing'"]),
        (("--save", "/nowhere/rig.csv"), ["/nowhere/rig.csv: cannot be written"]),
        (("--figures", EXAMPLE), [str(EXAMPLE), "folder"]),
        (("--data", "/nowhere.csv"), ["/nowhere.csv: no such file"]),
        (("--data", "/dev/zero"), ["/dev/zero: cannot be read: not a regular file"]),
        (("--save", "/dev/full"), ["/dev/full: cannot be written: not a regular file"]),
    ],
)
def test_invalid_options_are_rejected_at_once_with_one_line(arguments, facts):
    message = error_line(*arguments)
    assert [fact for fact in facts if fact not in message] == []


def test_too_few_contacts_are_rejected_with_the_counts_of_excluded_contacts(tmp_path):
    file = tmp_path / "rig.csv"
    recorded = trial(*force_n(9.0, (1.0, 0.5, 0.5, 2.0), (4.0, 0.5, 0.5, 0.3), (6.5, 0.5, 0.5, 2.0)))
    rows = zip(recorded.t_s, recorded.pressure_kpa, recorded.force_n, strict=True)
    file.write_text("t_s,pressure_kpa,force_n\n" + "".join(f"{t:.3f},{p:.4f},{f:.3f}\n" for t, p, f in rows))
    message = error_line("--data", file)
    assert message.removeprefix("pneuforce: ").startswith(f"{file}: 2 contacts")
    assert "at least 3 are needed; 3 were found" in message
    assert "1 with a rise below 0.5 kPa" in message


def test_the_error_about_a_missing_matplotlib_names_the_command_that_installs_it(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(ConfigurationError, match="-m pip install matplotlib"):
        prepare_folder(tmp_path / "figures", overwrite=False)
    assert not (tmp_path / "figures").exists()


def test_a_clipped_pressure_gives_a_warning_with_the_number_of_samples(tmp_path):
    header, *rows = EXAMPLE.read_text().splitlines()
    samples = [row.split(",") for row in rows]
    count = sum(float(kpa) >= 11 for _, kpa, *_ in samples)
    lines = [header, *(",".join([t_s, str(min(float(kpa), 11.0)), *rest]) for t_s, kpa, *rest in samples)]
    file = tmp_path / "clipped.csv"
    file.write_text("\n".join(lines))
    done = validate("--data", file)
    warning = f"the pressure of {count} samples is clipped at 11 kPa"
    assert (done.returncode, done.stderr.startswith(f"pneuforce: {warning}")) == (0, True)
    as_json = validate("--data", file, "--json")
    report = json.loads(as_json.stdout)
    assert (report["ok"], as_json.stderr) == (True, "")
    assert warning in report["remark"]
    assert warning in report["message"]
    assert json.loads(validate("--data", EXAMPLE, "--json").stdout)["remark"] == ""
