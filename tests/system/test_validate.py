"""`pneuforce validate`: a short campaign, its recording, its figures, and what is refused."""

import json
import sys
from pathlib import Path

import pytest

from instrument.errors import ConfigurationError
from instrument.validation.figures import prepared
from tests.instrument.validation.pressing import force_n, trial
from tests.typed import pneuforce

TOP = Path(__file__).parents[2]
SCENARIO = TOP / "docs/examples/three-pressures.toml"
EXAMPLE = TOP / "docs/examples/validation-recording.csv"
FIGURES = {"fig4-radius", "fig6a-slow", "fig6b-fast", "fig6c-continuous", "fig7-errors", "law"}
ERRORS = {"solved": int, "absolute": (float, type(None)), "signed": (float, type(None))}


def validate(*arguments):
    return pneuforce("validate", *arguments)


def refusal(*arguments):
    refused = validate(*arguments)
    assert (refused.returncode, refused.stdout) == (2, "")
    assert len(refused.stderr.strip().splitlines()) == 1, refused.stderr
    return refused.stderr


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    """The answer of a short campaign, and the folder with what it wrote."""
    folder = tmp_path_factory.mktemp("campaign")
    written = ("--save", folder / "rig.csv", "--figures", folder / "figures")
    done = validate("--scenario", SCENARIO, "--plant", "published", "--seed", "7", "--json", *written)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""  # no bar where there is no terminal
    return json.loads(done.stdout), folder


def test_the_answer_says_what_was_simulated_and_what_became_of_the_contacts(campaign):
    answer, _ = campaign
    source, contacts = answer["source"], answer["contacts"]
    assert (source["plant"], source["seed"], source["contacts"]) == ("published", 7, 9)
    assert source["played_to_its_end"] is True
    assert (answer["trials"], contacts["found"]) == (3, 9)
    # on the published balloon 1.6 N at 10.5 kPa raise the pressure by less than 0.5 kPa
    assert (contacts["evaluated"], contacts["too_small"]) == (8, 1)
    assert answer["law"] == {"switch": "paper", "low": "line"}


def test_every_group_has_every_method_beside_the_papers_figure(campaign):
    groups = {group["group"]: group for group in campaign[0]["peak_errors_percent"]}
    assert len(groups) == 9
    for group in groups.values():
        for method in ("energetic", "lulevich", "shanahan"):
            for key, kind in ERRORS.items():
                assert isinstance(group[method][key], kind), (group["group"], method, key)
    assert groups["all contacts"]["energetic"]["paper"] == 9.14
    assert groups["6.25–7.55 kPa"]["count"] == 0
    assert groups["6.25–7.55 kPa"]["energetic"]["absolute"] is None


def test_on_a_balloon_that_obeys_the_law_the_plumbing_costs_less_than_one_per_cent(campaign):
    [everything, *_] = campaign[0]["peak_errors_percent"]
    assert everything["energetic"]["absolute"] < 1.0
    assert everything["lulevich"]["absolute"] > 5.0


def test_compensation_beats_hindsight(campaign):
    continuous = campaign[0]["continuous"]
    assert continuous["compensated_n"] < continuous["shifted_n"] < continuous["uncompensated_n"]
    assert 0.09 < continuous["shift_s"] < 0.15
    assert (continuous["paper_n"], continuous["paper_shift_s"]) == (0.578, 0.12)


def rounded(part):
    """Numbers to a thousandth, whatever they are in."""
    if isinstance(part, dict):
        return {key: rounded(value) for key, value in part.items()}
    if isinstance(part, list):
        return [rounded(value) for value in part]
    return pytest.approx(part, abs=2e-3, rel=1e-3) if isinstance(part, float) else part


def test_the_saved_recording_gives_the_same_report(campaign):
    answer, folder = campaign
    again = json.loads(validate("--data", folder / "rig.csv", "--json").stdout)
    for key in ("trials", "contacts", "peak_errors_percent", "volume_change", "continuous"):
        assert again[key] == rounded(answer[key]), key


def test_the_figures_are_drawn_in_both_formats(campaign):
    folder = campaign[1] / "figures"
    assert {file.name for file in folder.iterdir()} == {f"{n}.{f}" for n in FIGURES for f in ("png", "svg")}
    for file in folder.iterdir():
        begin = b"\x89PNG" if file.suffix == ".png" else b"<?xml"
        assert file.read_bytes().startswith(begin)
        assert 5_000 < file.stat().st_size < 100_000


def test_the_example_recording_is_validated_in_a_table_that_fits_a_terminal(tmp_path):
    done = validate("--data", EXAMPLE, "--figures", tmp_path)
    assert done.returncode == 0, done.stderr
    assert "9 contacts in 3 trials" in done.stdout
    assert "…" not in done.stdout
    assert max(map(len, done.stdout.splitlines())) <= 80
    assert {file.stem for file in tmp_path.iterdir()} == FIGURES - {"fig4-radius", "fig6b-fast"}


def test_the_low_end_can_be_smooth_which_changes_the_course_and_no_peak():
    papers, smooth = (
        json.loads(validate("--data", EXAMPLE, "--json", *law).stdout) for law in ((), ("--low", "smooth"))
    )
    assert smooth["law"] == {"switch": "paper", "low": "smooth"}
    assert smooth["peak_errors_percent"] == papers["peak_errors_percent"]
    assert smooth["continuous"]["compensated_n"] != papers["continuous"]["compensated_n"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--data", EXAMPLE, "--seed", "3"), "--scenario, --plant and --seed do not go with it"),
        (("--data", EXAMPLE, "--save", "/tmp/never.csv"), "it does not go with --data"),
        (("--scenario", "nothing"), "there is no scenario 'nothing'"),
        (("--save", "/nowhere/rig.csv"), "/nowhere/rig.csv: cannot be written"),
        (("--figures", EXAMPLE), "cannot be a folder"),
        (("--data", "/nowhere.csv"), "/nowhere.csv: no such file"),
        (("--data", "/dev/zero"), "/dev/zero: cannot be read: not a regular file"),
        (("--save", "/dev/full"), "/dev/full: cannot be written: not a regular file"),
    ],
)
def test_what_cannot_be_done_is_refused_at_once_in_one_sentence(arguments, said):
    assert said in refusal(*arguments)


def test_too_few_contacts_are_refused_with_what_became_of_those_that_were_found(tmp_path):
    file = tmp_path / "rig.csv"
    made = trial(*force_n(9.0, (1.0, 0.5, 0.5, 2.0), (4.0, 0.5, 0.5, 0.3), (6.5, 0.5, 0.5, 2.0)))
    rows = zip(made.t_s, made.pressure_kpa, made.force_n, strict=True)
    file.write_text("t_s,pressure_kpa,force_n\n" + "".join(f"{t:.3f},{p:.4f},{f:.3f}\n" for t, p, f in rows))
    said = refusal("--data", file)
    assert f"{file}: 2 contacts to be evaluated, at least 3 are needed; 3 were found" in said
    assert "1 with a rise below 0.5 kPa" in said


def test_a_missing_matplotlib_is_one_sentence_that_says_what_to_install(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(ConfigurationError, match="-m pip install matplotlib"):
        prepared(tmp_path / "figures")
    assert not (tmp_path / "figures").exists()
