"""Tests of `pneuforce plot`: contents of the figures, and rejected arguments."""

import csv
import json
import re
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.cli.recordings.plot import plot
from pneuforce.instrument.recording.contacts import ContactHistory
from pneuforce.instrument.recording.opening import open_recording
from pneuforce.instrument.stream.entry import EntryKind, json_entry
from pneuforce.instrument.validation.recording_plot import PlotOptions
from pneuforce.instrument.validation.reference_alignment import ReferenceInput
from tests.command_runner import pneuforce
from tests.instrument.recording.recorded_story import hold, press, record_story
from tests.instrument.recording.recording_files import make_recording

SVG = "{http://www.w3.org/2000/svg}"
PLACED = "{http://www.w3.org/1999/xlink}href"


def lose_the_lease(harness, file):
    """Record a trip by the host process. The samples show only a vent. The event contains the reason."""
    hold(harness)
    now_s = harness.now_s
    facts = {"at": "2027-01-31T08:00:00Z", "mono_s": now_s, "kind": "faults", "was": []}
    file.add_entry(json_entry(EntryKind.EVENT, now_s, {**facts, "is": ["lease expired (fault 32)"]}))
    harness.instrument.vent(now_s)
    harness.run(1.0)


def burst(harness, _):
    hold(harness)
    harness.push_kpa = 1.5
    harness.renew(1.0)
    harness.set_sensor_push(-8.0)
    harness.run(0.02)


@pytest.fixture(scope="module")
def pressed(tmp_path_factory):
    return record_story(tmp_path_factory.mktemp("pressed") / "press.recording", press)


@pytest.fixture(scope="module")
def rows(pressed):
    contacts = ContactHistory()
    with open_recording(pressed) as recording:
        for m in recording.samples():
            contacts.add_sample(m)
    return contacts.rows


@pytest.fixture(scope="module")
def figure(pressed):
    return draw(pressed)


def draw(recording, **options):
    out = recording.with_name("drawn.svg")
    plot(PlotOptions(recording, out, overwrite=True, **options))
    return ET.parse(out).getroot()


def texts(figure):
    return ["".join(text.itertext()) for text in figure.iter(f"{SVG}text")]


def stars(figure, name):
    """Return the positions of the stars in the group with this name. The y axis points downwards."""
    [group] = [group for group in figure.iter(f"{SVG}g") if group.get("id") == name]
    return [(float(use.get("x")), float(use.get("y"))) for use in group.iter(f"{SVG}use")]


def test_each_contact_has_its_two_stars_and_its_number(figure, rows):
    initial, final = stars(figure, "ΔP_i"), stars(figure, "ΔP_f")
    assert len(initial) == len(final) == len(rows) == 4
    for (left, low), (right, high) in zip(initial, final, strict=True):
        assert left < right
        assert low > high
    assert {"1", "2", "3", "4"} <= set(texts(figure))


def test_the_stars_are_at_the_pressures_and_times_of_the_contacts(figure, rows):
    for name, expected in (
        ("ΔP_i", [(row.initial_s, row.baseline_kpa) for row in rows]),
        ("ΔP_f", [(row.final_s, row.final_kpa) for row in rows]),
    ):
        for drawn, values in zip(
            zip(*stars(figure, name), strict=True), zip(*expected, strict=True), strict=True
        ):
            assert is_linear(drawn, values)


def is_linear(drawn, values):
    """Return True if the drawn positions are a linear function of the values."""
    low, high = min(values), max(values)
    if high - low < 0.01:
        return max(drawn) - min(drawn) < 5
    at = dict(zip(values, drawn, strict=True))
    slope = (at[high] - at[low]) / (high - low)
    return all(abs(at[value] - at[low] - slope * (value - low)) < 0.1 for value in values)


def test_axes_have_units_and_a_trip_has_the_name_of_its_fault(figure):
    labels = texts(figure)
    assert {"pressure [kPa]", "force [N]", "time in the recording [s]", "setpoint", "±2u"} <= set(labels)
    assert "tripped: overpressure (fault 4)" in labels
    assert "press  (simulated rig)" in labels


def test_a_decimated_recording_is_labelled(figure):
    assert any(re.fullmatch(r"\d.\d{3} samples; .* 0.\d+ s .*", line) for line in texts(figure))


@pytest.mark.parametrize("form", ["svg", "png", "pdf"])
def test_the_same_recording_makes_the_same_bytes(pressed, tmp_path, form, monkeypatch):
    first, second = tmp_path / f"a.{form}", tmp_path / f"b.{form}"
    plot(PlotOptions(pressed, first))
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1")
    import matplotlib

    with matplotlib.rc_context({"font.size": 30, "lines.linewidth": 9}):  # settings of a user
        plot(PlotOptions(pressed, second))
    assert first.read_bytes() == second.read_bytes()
    assert b"date" not in first.read_bytes().lower()


def test_a_time_span_shows_its_contacts(pressed, rows):
    with open_recording(pressed) as recording:
        begin_s = recording.begin_s
    part = draw(pressed, from_s=rows[1].begin_s - begin_s - 0.1, to_s=rows[1].final_s - begin_s + 0.1)
    assert len(stars(part, "ΔP_f")) == 1


def test_a_trip_recorded_only_in_the_event_log_is_named(tmp_path):
    lost = draw(record_story(tmp_path / "lease.recording", lose_the_lease))
    assert "tripped: lease expired (fault 32)" in texts(lost)
    assert "vented" not in texts(lost)


def test_the_force_axis_is_not_scaled_by_the_uncertainty_of_a_burst(tmp_path):
    """A burst of the balloon makes the uncertainty of the force very large for a short time."""
    burst_figure = draw(record_story(tmp_path / "burst.recording", burst))
    ticks = [float(text.replace("−", "-")) for text in texts(burst_figure) if re.fullmatch(r"−?[\d.]+", text)]
    with open_recording(tmp_path / "burst.recording") as recording:
        assert max(m.force_std_n for m in recording.samples() if m.in_contact) > 5
    assert min(ticks) > -1


def low(harness, _):
    """Press below the validated range. Such a contact has pressures but no force."""
    hold(harness)
    harness.write_ok({"setpoint_requested_kpa": 3.0})
    harness.renew(2.0)
    harness.push_kpa = 1.0
    harness.renew(0.5)


def test_a_contact_without_an_uncertainty_is_drawn(tmp_path):
    assert "1" in texts(draw(make_recording(tmp_path / "a.recording", 100)))


def test_the_curve_is_interrupted_where_samples_are_missing(tmp_path):
    def story(harness, _):
        hold(harness)
        harness.run_without_samples(100.0)
        harness.run(1.0)

    silent = draw(record_story(tmp_path / "silent.recording", story))
    assert "no samples" in texts(silent)
    [pressure] = [group for group in silent.iter(f"{SVG}g") if group.get("id") == "pressure, filtered"]
    [path] = pressure.iter(f"{SVG}path")
    steps = [float(x) for x in re.findall(r"L ([\d.]+)", path.get("d"))]
    assert len(re.findall("M ", path.get("d"))) == 2
    assert steps == sorted(steps)


EMPTY_STORIES = {
    "vented all the time: no force": lambda harness, _: harness.run(1.0),
    "no contact": hold,
    "no force in any contact": low,
}


@pytest.mark.parametrize("sentence", EMPTY_STORIES)
def test_a_figure_without_force_contains_the_reason(tmp_path, sentence):
    recording = record_story(tmp_path / "a.recording", EMPTY_STORIES[sentence])
    assert sentence in texts(draw(recording))
    assert sentence in texts(draw(recording, by_pressure=True))


def percentages(figure):
    return [text for text in texts(figure) if re.fullmatch(r"\d+\.\d\d", text)]


def test_by_pressure_the_stated_uncertainty_is_shown(pressed, rows):
    bars = draw(pressed, by_pressure=True)
    evaluated = [row for row in rows if row.final_kpa - row.baseline_kpa >= 0.5]
    mean = sum(100 * row.peak_std_n / row.peak_n for row in evaluated) / len(evaluated)
    assert percentages(bars) == [f"{mean:.2f}"]
    assert texts(bars).count("n = 0") == 4
    assert f"n = {len(evaluated)}" in texts(bars)


def test_by_pressure_the_errors_beside_a_reference_are_shown(pressed, rows, tmp_path):
    """The reference reads 25 % more than the peaks, which is an error of 20 % of the reference."""
    reference = tmp_path / "cell.csv"
    with open_recording(pressed) as recording, reference.open("w") as file:
        table, begin_s = csv.writer(file), recording.begin_s
        table.writerow(["t_s", "force_n"])
        for row in rows:
            table.writerow([row.begin_s - begin_s, 0.0])
            table.writerow([row.begin_s - begin_s + row.duration_s / 2, 1.25 * row.peak_n])
    assert percentages(
        draw(pressed, by_pressure=True, reference=ReferenceInput(reference, offset_s=0.0))
    ) == ["20.00"]


def test_the_command_writes_a_png_beside_the_recording(pressed):
    done = pneuforce("plot", pressed)
    assert done.returncode == 0
    assert done.stdout == f"{pressed.with_suffix('.png')}: 8.6 s, 4 contacts\n"
    assert "has no end" in done.stderr
    image = pressed.with_suffix(".png").read_bytes()
    assert image.startswith(b"\x89PNG")
    again = pneuforce("plot", pressed)
    assert again.returncode == 2
    assert "--overwrite" in again.stderr
    assert pressed.with_suffix(".png").read_bytes() == image


def test_the_json_of_a_plot_has_its_facts(pressed, tmp_path):
    out = tmp_path / "a.png"
    done = pneuforce("plot", pressed, out, "--from-s", "1", "--json")
    result = json.loads(done.stdout)
    assert (done.returncode, done.stderr, result["ok"], result["out"]) == (0, "", True, str(out))
    assert (result["contacts"], result["damaged"]) == (4, False)
    assert 1.0 <= result["from_s"] < 1.01 < 8.5 < result["to_s"] < 8.7
    assert "has no end" in result["remark"]


@pytest.mark.parametrize(
    ("options", "why"),
    [
        (["a.jpg"], "name a file .png, .svg or .pdf"),
        (["--reference", "cell.csv"], "--reference is valid only with --by-pressure"),
        (["--from-s", "3", "--to-s", "2"], "--from-s must be less than --to-s"),
        (["a.png", "--from-s", "100"], "no samples in this time range"),
        (["missing/a.png"], "cannot be written"),
        (["--by-pressure", "--reference", "missing.csv", "--overwrite"], "no such file"),
    ],
)
def test_invalid_arguments_are_rejected_in_one_line(pressed, options, why):
    rejected = pneuforce("plot", pressed, *options)
    assert rejected.returncode == 2
    assert why in rejected.stderr
    assert len(rejected.stderr.strip().splitlines()) == 1


def test_a_file_that_is_not_a_recording_is_rejected_and_not_changed(tmp_path):
    other = tmp_path / "notes.recording"
    other.write_text("a text")
    with pytest.raises(ConfigurationError):
        plot(PlotOptions(other))
    assert [file.name for file in Path(tmp_path).iterdir()] == ["notes.recording"]


def test_without_matplotlib_the_message_has_the_command_to_install_it(pressed, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(ConfigurationError, match=r"matplotlib.*-m pip install"):
        plot(PlotOptions(pressed, tmp_path / "new.png"))
    with pytest.raises(ConfigurationError, match="the file does not exist"):
        plot(PlotOptions(tmp_path / "missing.recording"))
