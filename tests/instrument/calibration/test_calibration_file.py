"""The calibration file: what is written is read, and what is not whole or not right is refused by key."""

from datetime import date

import numpy as np
import pytest

from instrument.calibration import file, parts
from instrument.calibration.force import calibration_of
from instrument.calibration.lag import Lag
from instrument.calibration.radius import radius_of
from instrument.calibration.residuals import bins
from instrument.calibration.volume import Volume
from instrument.model import Balloon
from tests.instrument.calibration.points import points, refusal_of
from tests.instrument.calibration.test_force import OWN, TRUTH, distorted

TODAY = date(2026, 3, 1)
PRESSURES_KPA = np.linspace(2.0, 11.5, 22)
CALIPER = points(pressure_kpa=PRESSURES_KPA, radius_mm=Balloon().radius_mm(PRESSURES_KPA) + 0.1)


def force_part(own=OWN, today=TODAY, **truth):
    found = calibration_of(distorted(1, own=own, **truth or TRUTH)[0], own)
    return parts.force_part(found, bins(found.chosen.unseen_n, found.contacts), CALIPER, own, today)


def whole():
    return file.empty(7).model_copy(
        update={
            "radius": parts.radius_part(radius_of(CALIPER), CALIPER, TODAY),
            "volume": parts.volume_part(Volume(12_500.0, 300.0, 0.02), CALIPER, 101.325, date(2026, 2, 1)),
            "lag": parts.lag_part(Lag(0.055, 0.001, -3.0, 0.01), CALIPER, TODAY),
            "force": force_part(),
        }
    )


WHOLE = whole()


def saved(tmp_path, text):
    path = tmp_path / "calibration.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_what_is_written_is_what_is_read(tmp_path):
    path = tmp_path / "calibration.toml"
    file.save(WHOLE, path)
    assert file.load(path) == WHOLE
    assert [p.name for p in tmp_path.iterdir()] == ["calibration.toml"]


def test_it_tells_of_each_part_when_it_was_made_and_of_what(tmp_path):
    for part in file.load(saved(tmp_path, file.text(WHOLE))).parts:
        assert (part.source, part.source_sha256, part.points) == ("mine.csv", CALIPER.sha256, 22)
    assert WHOLE.date_code == 20260301
    assert file.empty(0).date_code == 0


def test_names_with_quotes_and_backslashes_survive(tmp_path):
    odd = WHOLE.radius.model_copy(update={"source": 'C:\\new "one"\n\x7f é.csv'})
    path = saved(tmp_path, file.text(WHOLE.model_copy(update={"radius": odd})))
    assert file.load(path).radius.source == odd.source


def test_every_beginning_of_a_file_is_refused_by_name(tmp_path):
    text = file.text(WHOLE)
    for length in [*range(0, len(text) - len("true\n"), 37), len(text) - len("true\n") - 1]:
        said = refusal_of(file.load, saved(tmp_path, text[:length]))
        assert all(line.startswith(f"{tmp_path / 'calibration.toml'}: ") for line in said.splitlines())


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("version = 1", "version = 2", "version = 2: "),
        ("tube_s = 0.055", "tube_s = 5.5", "lag.tube_s = 5.5: "),
        ("tube_s = 0.055", "tube_s = 5.5", "; allowed: 0.001 to 0.5"),
        ("tube_s = 0.055", "tube_s = nan", "lag.tube_s = nan: "),
        ("tube_s = 0.055", 'tube_s = "0.055"', "lag.tube_s = '0.055': "),
        ("tube_s = 0.055", "tube_ms = 55", "lag.tube_ms: unknown key; known here: date, source,"),
        ("tube_s = 0.055", "", "lag.tube_s: missing"),
        ("balloon_id = 7", "balloon_id = -7", "balloon_id = -7: "),
        ('switch = "blend"', 'switch = "none"', "force.made_for.switch = 'none': "),
        ("date = 2026-02-01", "date = 20260201", "volume.date = 20260201: "),
        ("[lag]", "[leg]", "leg: unknown key; known here: version, balloon_id, radius,"),
        ("rise_low_kpa = 0.", "rise_low_kpa = 9.", "rise_low_kpa is above rise_high_kpa"),
        ("whole = true", "whole = false", "end.whole = False: "),
    ],
)  # fmt: skip
def test_what_is_wrong_is_refused_with_file_key_and_span(tmp_path, old, new, said):
    text = file.text(WHOLE)
    assert old in text
    path = saved(tmp_path, text.replace(old, new, 1))
    told = refusal_of(file.load, path)
    assert told.startswith(f"{path}: ")
    assert said in told


KEYS = [n for n, line in enumerate(file.text(WHOLE).splitlines()) if " = " in line and line[0] != "#"]


@pytest.mark.parametrize(
    "value", ["nan", "-1e300", '"x"', "[]", "{}", "[[[1]]]", "true", "2026-01-01T00:00:00"]
)
def test_no_value_of_any_key_is_more_than_a_sentence(tmp_path, value):
    for n in KEYS:
        lines = file.text(WHOLE).splitlines()
        key = lines[n].split(" = ")[0]
        lines[n] = f"{key} = {value}"
        if (key, value) in (("source", '"x"'), ("whole", "true"), ("bin", "[]")):
            continue
        said = refusal_of(file.load, saved(tmp_path, "\n".join(lines)))
        assert f"{key}" in said
        assert said.count("\n") < 6


def test_a_missing_file_is_told_with_the_command_that_writes_one(tmp_path):
    assert "pneuforce calibrate force" in refusal_of(file.load, tmp_path / "absent.toml")


def test_a_file_that_cannot_be_written_is_a_sentence(tmp_path):
    assert "cannot be written" in refusal_of(file.save, WHOLE, tmp_path / "absent" / "calibration.toml")
