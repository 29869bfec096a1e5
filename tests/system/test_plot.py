"""`pneuforce plot`: what is in the pictures of a recording, and what is refused."""

import csv
import re
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from instrument.cli.plot import Wish, plot
from instrument.errors import ConfigurationError
from instrument.tape.contacts import Contacts
from instrument.tape.entry import Entry, Kind, told
from instrument.tape.file import TapeFile
from instrument.tape.measured import pack
from instrument.tape.opening import opened
from tests.instrument.driving import HOLD_8, VENT, Drive
from tests.instrument.tape.taping import ended
from tests.typed import pneuforce

OVERPRESSURE = 4
PUSHES_KPA = (1.0, 0.0, 2.0, 0.3, 1.5, 0.0, 0.2, 0.0)
SVG = "{http://www.w3.org/2000/svg}"
PLACED = "{http://www.w3.org/1999/xlink}href"


def recorded(path, story):
    """A recording of what happens to an instrument whose sensor has its zero."""
    drive, file = Drive.zeroed(), TapeFile(path)
    file.put(told(Kind.BEGIN, drive.now_s, {"version": "0.1.0", "simulated": True}))
    take = drive.instrument.take

    def taken(raw):
        m = take(raw)
        file.put(Entry(Kind.MEASURED, raw.t_s, pack(raw, m)))
        return m

    drive.instrument.take = taken
    story(drive, file)
    file.commit()
    file.close()
    return path


def hold(drive, _=None):
    drive.must(VENT)
    drive.must(HOLD_8)
    drive.renew(2.0)


def press(drive, _=None):
    hold(drive)
    for push_kpa in PUSHES_KPA:
        drive.push_kpa = push_kpa
        drive.renew(0.7)
    drive.causes.add(OVERPRESSURE)
    drive.run(1.0)


def lose_the_lease(drive, file):
    """The host trips of itself: the board only vents, and the event log alone says why."""
    hold(drive)
    now_s = drive.now_s
    facts = {"at": "2027-01-31T08:00:00Z", "mono_s": now_s, "kind": "faults", "was": []}
    file.put(told(Kind.EVENT, now_s, {**facts, "is": ["lease expired"]}))
    drive.instrument.vent(now_s)
    drive.run(1.0)


def burst(drive, _):
    hold(drive)
    drive.push_kpa = 1.5
    drive.renew(1.0)
    drive.hit(-8.0)
    drive.run(0.02)


@pytest.fixture(scope="module")
def pressed(tmp_path_factory):
    return recorded(tmp_path_factory.mktemp("pressed") / "press.tape", press)


@pytest.fixture(scope="module")
def rows(pressed):
    contacts = Contacts()
    with opened(pressed) as recording:
        for m in recording.samples():
            contacts.take(m)
    return contacts.rows


@pytest.fixture(scope="module")
def picture(pressed):
    return drawn(pressed)


def drawn(recording, **wishes):
    out = recording.with_name("drawn.svg")
    plot(Wish(recording, out, **wishes))
    return ET.parse(out).getroot()


def words(picture):
    return ["".join(text.itertext()) for text in picture.iter(f"{SVG}text")]


def stars(picture, name):
    """Where the stars of that name stand; y counts downwards."""
    [group] = [group for group in picture.iter(f"{SVG}g") if group.get("id") == name]
    return [(float(use.get("x")), float(use.get("y"))) for use in group.iter(f"{SVG}use")]


def test_each_contact_has_its_two_stars_and_its_number(picture, rows):
    initial, final = stars(picture, "ΔP_i"), stars(picture, "ΔP_f")
    assert len(initial) == len(final) == len(rows) == 4
    for (left, low), (right, high) in zip(initial, final, strict=True):
        assert left < right
        assert low > high
    assert {"1", "2", "3", "4"} <= set(words(picture))


def test_the_stars_stand_at_the_pressures_and_times_of_the_contacts(picture, rows):
    for name, wanted in (
        ("ΔP_i", [(row.initial_s, row.initial_kpa) for row in rows]),
        ("ΔP_f", [(row.final_s, row.final_kpa) for row in rows]),
    ):
        for seen, meant in zip(
            zip(*stars(picture, name), strict=True), zip(*wanted, strict=True), strict=True
        ):
            assert lined_up(seen, meant)


def lined_up(seen, meant):
    """Whether one goes as the other: the greatest distance shows as the greatest, and so on."""
    low, high = min(meant), max(meant)
    if high - low < 0.01:
        return max(seen) - min(seen) < 5
    at = dict(zip(meant, seen, strict=True))
    share = (at[high] - at[low]) / (high - low)
    return all(abs(at[value] - at[low] - share * (value - low)) < 0.1 for value in meant)


def test_axes_have_units_and_what_tripped_it_has_its_name(picture):
    said = words(picture)
    assert {"pressure [kPa]", "force [N]", "time in the recording [s]", "setpoint", "±2u"} <= set(said)
    assert "tripped: overpressure" in said
    assert "press  (simulated rig)" in said


def test_a_recording_that_is_thinned_says_so(picture):
    assert any(re.fullmatch(r"\d.\d{3} samples: of each 0.\d+ s .*", line) for line in words(picture))


@pytest.mark.parametrize("form", ["svg", "png"])
def test_the_same_recording_makes_the_same_bytes(pressed, tmp_path, form, monkeypatch):
    first, again = tmp_path / f"a.{form}", tmp_path / f"b.{form}"
    plot(Wish(pressed, first))
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1")
    import matplotlib

    with matplotlib.rc_context({"font.size": 30, "lines.linewidth": 9}):  # somebody's own matplotlibrc
        plot(Wish(pressed, again))
    assert first.read_bytes() == again.read_bytes()
    assert b"date" not in first.read_bytes().lower()


def test_a_part_has_the_contacts_of_that_part(pressed, rows):
    with opened(pressed) as recording:
        begin_s = recording.begin_s
    part = drawn(pressed, from_s=rows[1].begin_s - begin_s - 0.1, to_s=rows[1].final_s - begin_s + 0.1)
    assert len(stars(part, "ΔP_f")) == 1


def test_what_only_the_event_log_knows_names_the_vent(tmp_path):
    lost = drawn(recorded(tmp_path / "lease.tape", lose_the_lease))
    assert "tripped: lease expired" in words(lost)
    assert "vented" not in words(lost)


def test_a_burst_hides_no_force_behind_its_own_uncertainty(tmp_path):
    """The pressure falls in a moment, and nobody knows the force just then."""
    torn = drawn(recorded(tmp_path / "burst.tape", burst))
    ticks = [float(word.replace("−", "-")) for word in words(torn) if re.fullmatch(r"−?[\d.]+", word)]
    with opened(tmp_path / "burst.tape") as recording:
        assert max(m.force_std_n for m in recording.samples() if m.in_contact) > 5
    assert min(ticks) > -1


def low(drive, _):
    """Below the validated range a contact has pressures and no force."""
    hold(drive)
    drive.must({"setpoint_requested_kpa": 3.0})
    drive.renew(2.0)
    drive.push_kpa = 1.0
    drive.renew(0.5)


def test_a_contact_whose_uncertainty_is_not_known_is_drawn(tmp_path):
    assert "1" in words(drawn(ended(tmp_path / "a.tape", 100)))


def test_no_line_is_drawn_through_a_silence(tmp_path):
    def story(drive, _):
        hold(drive)
        drive.silence(100.0)
        drive.run(1.0)

    silent = drawn(recorded(tmp_path / "silent.tape", story))
    assert "no samples" in words(silent)
    [pressure] = [group for group in silent.iter(f"{SVG}g") if group.get("id") == "pressure, filtered"]
    [path] = pressure.iter(f"{SVG}path")
    steps = [float(x) for x in re.findall(r"L ([\d.]+)", path.get("d"))]
    assert len(re.findall("M ", path.get("d"))) == 2
    assert steps == sorted(steps)


NOTHING = {
    "no samples": lambda *_: None,
    "vented all the time: no force": lambda drive, _: drive.run(1.0),
    "no contact": hold,
    "no force in any contact": low,
}


@pytest.mark.parametrize("sentence", NOTHING)
def test_where_nothing_is_to_be_seen_a_sentence_stands(tmp_path, sentence):
    recording = recorded(tmp_path / "a.tape", NOTHING[sentence])
    assert sentence in words(drawn(recording))
    assert sentence in words(drawn(recording, by_pressure=True))


def percentages(picture):
    return [word for word in words(picture) if re.fullmatch(r"\d+\.\d\d", word)]


def test_by_pressure_the_stated_uncertainty_is_shown(pressed, rows):
    bars = drawn(pressed, by_pressure=True)
    great = [row for row in rows if row.final_kpa - row.initial_kpa >= 0.5]
    mean = sum(100 * row.peak_std_n / row.peak_n for row in great) / len(great)
    assert percentages(bars) == [f"{mean:.2f}"]
    assert words(bars).count("n = 0") == 4
    assert f"n = {len(great)}" in words(bars)


def test_by_pressure_the_errors_beside_a_reference_are_shown(pressed, tmp_path):
    """The reference reads a quarter more than the instrument: an error of a fifth of the reference."""
    reference = tmp_path / "cell.csv"
    with opened(pressed) as recording, reference.open("w") as file:
        rows = csv.writer(file)
        rows.writerow(["t_s", "force_n"])
        forces = ((m.t_s - recording.begin_s, m.force_n) for m in recording.samples())
        rows.writerows((t_s, 1.25 * force_n) for t_s, force_n in forces if force_n == force_n)
    assert percentages(drawn(pressed, by_pressure=True, reference=reference)) == ["20.00"]


def test_the_command_puts_a_png_beside_the_recording(pressed):
    done = pneuforce("plot", pressed)
    assert done.returncode == 0
    assert done.stdout == f"{pressed.with_suffix('.png')}: 8.6 s, 4 contacts\n"
    assert "has no end" in done.stderr
    assert pressed.with_suffix(".png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("options", "why"),
    [
        (["a.jpg"], "a picture is .png or .svg"),
        (["--reference", "cell.csv"], "--reference goes with --by-pressure"),
        (["--from-s", "3", "--to-s", "2"], "--from-s must be less than --to-s"),
        (["missing/a.png"], "cannot be written"),
        (["--by-pressure", "--reference", "missing.csv"], "no such file"),
    ],
)
def test_what_cannot_be_drawn_is_refused_in_a_sentence(pressed, options, why):
    refused = pneuforce("plot", pressed, *options)
    assert refused.returncode == 2
    assert why in refused.stderr
    assert len(refused.stderr.strip().splitlines()) == 1


def test_what_is_no_recording_is_refused_and_stays(tmp_path):
    other = tmp_path / "notes.tape"
    other.write_text("a text")
    with pytest.raises(ConfigurationError):
        plot(Wish(other))
    assert [file.name for file in Path(tmp_path).iterdir()] == ["notes.tape"]


def test_without_matplotlib_a_sentence_tells_how_to_get_it(pressed, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(ConfigurationError, match=r"pneuforce plot needs matplotlib: .*-m pip install"):
        plot(Wish(pressed))
