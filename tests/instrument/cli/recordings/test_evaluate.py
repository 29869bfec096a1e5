"""Tests of `pneuforce evaluate`: forces of a recording with another calibration, by the instrument itself."""

import csv
import json
import math
import re
import shutil
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import pytest

from pneuforce.instrument.calibration.file import load as load_calibration
from pneuforce.instrument.calibration.file import save
from pneuforce.instrument.cli.recordings.plot import plot
from pneuforce.instrument.cli.recordings.reference_comparison import ReferenceComparison
from pneuforce.instrument.config import Configuration, load
from pneuforce.instrument.core.controller import Instrument
from pneuforce.instrument.core.session import Session
from pneuforce.instrument.recording.contact_table import collect_contacts
from pneuforce.instrument.recording.evaluation import change_settings, evaluate_samples, pair_contacts
from pneuforce.instrument.recording.opening import open_recording
from pneuforce.instrument.recording.replay import replay_input
from pneuforce.instrument.service.replay_verification import initial_session
from pneuforce.instrument.stream.sample_record import pack, unpack
from pneuforce.instrument.validation.clock_offset import ClockOffset
from pneuforce.instrument.validation.figures import BLUE, YELLOW
from pneuforce.instrument.validation.plateau_forces import PlateauForces
from pneuforce.instrument.validation.recording_plot import PlotOptions
from pneuforce.instrument.validation.reference_alignment import AlignedReference
from pneuforce.instrument.validation.reference_pairs import PairedContact
from tests.command_runner import pneuforce
from tests.instrument.calibration.test_golden import GOLDEN
from tests.instrument.recording.recording_files import comparable
from tests.instrument.recording.virtual_host import VirtualHost, write_recording

RADII = Path(__file__).parents[4] / "docs/examples/radius.csv"
SVG = "{http://www.w3.org/2000/svg}"


def evaluated(path, configuration):
    with open_recording(path) as source:
        session = initial_session(source)
        change_settings(session, configuration.settings())
        return list(evaluate_samples(session, source.entries(), source.samples()))


def test_with_the_recorded_settings_every_bit_is_that_of_the_recording(recording):
    pairs = evaluated(recording, Configuration())
    assert len(pairs) > 4000
    assert any(recorded.in_contact and recorded.force_n > 0.5 for recorded, _ in pairs)
    assert comparable(now for _, now in pairs) == comparable(before for before, _ in pairs)


def test_with_a_calibration_the_forces_are_those_of_an_instrument_that_had_this_calibration(
    recording, config
):
    configuration = load(config)
    session = Session(Instrument(configuration.settings()))
    with open_recording(recording) as source:
        live = [
            unpack(pack(sample.raw, sample.measurement))
            for entry in source.entries()
            for sample in replay_input(session, entry)
        ]
    pairs = evaluated(recording, configuration)
    assert comparable(now for _, now in pairs) == comparable(live[: len(pairs)])
    changed = [abs(now.force_n / before.force_n - 1) for before, now in pairs if before.force_n > 1.0]
    assert max(changed) > 0.1


def test_an_evaluated_force_never_vents_the_balloon(recording, config):
    with open_recording(recording) as source:
        session = initial_session(source)
        instrument = session.instrument
        instrument.settings = replace(instrument.settings, vent_on_force_limit=True)
        instrument.requested.force_limit_n = 0.1
        change_settings(session, load(config).settings())
        pairs = list(evaluate_samples(session, source.entries(), source.samples()))
    assert max(now.force_n for _, now in pairs if now.in_contact) > 0.1
    assert not instrument.faults


def test_the_command_compares_the_contacts_and_writes_both_tables(recording, config, tmp_path):
    files = ("--contacts", tmp_path / "contacts.csv", "--samples", tmp_path / "samples.csv")
    done = pneuforce("evaluate", recording, "--config", config, "--json", *files)
    assert done.returncode == 0, done.stderr
    facts = json.loads(done.stdout)
    pairs = evaluated(recording, load(config))
    expected = collect_contacts((now for _, now in pairs), 0.06)
    assert [row["force_n"] for row in facts["contacts"]] == [contact.force_n for contact in expected]
    before = collect_contacts((recorded for recorded, _ in pairs), 0.06)
    assert [row["recorded_force_n"] for row in facts["contacts"]] == [contact.force_n for contact in before]
    assert facts["samples"] == len(pairs)
    with (tmp_path / "contacts.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [float(row["force_n"]) for row in rows] == [contact.force_n for contact in expected]
    with (tmp_path / "samples.csv").open() as file:
        last = list(csv.DictReader(file))[-1]
    assert float(last["pressure_kpa"]) == pairs[-1].evaluated.pressure_kpa
    shown = pneuforce("evaluate", recording, "--config", config)
    assert shown.returncode == 0
    has_parts = any(contact.state in ("cut", "open") for contact in expected)
    assert len(shown.stdout.splitlines()) == 3 + len(expected) + has_parts


def test_a_contact_at_the_start_of_the_recording_is_marked_as_cut(config, tmp_path):
    host = VirtualHost()
    host.inflate()
    host.wait_for_contact()
    host.run(0.3)
    host.record()
    host.run(6.0)
    path = tmp_path / "cut.recording"
    write_recording(host.recorded(), path)
    done = pneuforce("evaluate", path, "--config", config)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert (lines[2].split()[1], lines[2].split()[-1]) == ("0.00", "cut")
    assert lines[3].split()[-1] == "open"
    assert any(line.startswith("cut, open: ") for line in lines)


def test_a_calibrated_grip_that_the_method_does_not_use_is_named(recording, tmp_path):
    file = tmp_path / "calibration.toml"
    assert pneuforce("calibrate", "radius", RADII, "--out", file).returncode == 0
    weight = ("--mass-g", "120", "--before-kpa", "8", "--after-kpa", "9.1", "--out", file)
    assert pneuforce("calibrate", "grip", *weight).returncode == 0
    done = pneuforce("evaluate", recording, "--calibration", file, "--json")
    assert (done.returncode, "grip" in json.loads(done.stdout)["remark"]) == (0, True)


def test_a_file_is_replaced_only_on_request_and_an_invalid_file_is_rejected(recording, config, tmp_path):
    out = tmp_path / "contacts.csv"
    out.write_text("old")
    for words in (("--contacts", out), ("--contacts", tmp_path / "a.table"), ("--samples", out)):
        refused = pneuforce("evaluate", recording, "--config", config, *words)
        assert (refused.returncode, len(refused.stderr.splitlines())) == (2, 1)
    assert out.read_text() == "old"
    assert pneuforce("evaluate", recording, "--config", Path("/nowhere.toml")).returncode == 78
    assert pneuforce("evaluate", GOLDEN, "--config", config).returncode == 2
    assert pneuforce("evaluate", recording).returncode == 2
    assert pneuforce("evaluate", recording, "--reference-gain-percent", "1").returncode == 2


def test_a_recording_of_another_version_is_evaluated_with_a_remark(entries, config, tmp_path):
    write_recording(entries, tmp_path / "old.recording", version="0.0.9", map_hash="0")
    done = pneuforce("evaluate", tmp_path / "old.recording", "--config", config, "--json")
    assert done.returncode == 0, done.stderr
    assert "0.0.9" in json.loads(done.stdout)["remark"]


def test_a_contact_without_a_recorded_counterpart_has_no_recorded_force(recording):
    pairs = evaluated(recording, Configuration())
    contacts = collect_contacts((now for _, now in pairs), 0.06)
    assert [pair.recorded for pair in pair_contacts(contacts, contacts)] == contacts
    assert [pair.recorded for pair in pair_contacts(contacts[:1], contacts)][1:] == [None] * (
        len(contacts) - 1
    )
    assert [pair.recorded for pair in pair_contacts(contacts[1:], contacts)] == [None, *contacts[1:]]


def test_the_recording_of_the_calibration_is_named_in_a_remark(entries, tmp_path):
    shutil.copy(GOLDEN, tmp_path / "calibration.toml")
    calibration, path = load_calibration(GOLDEN), tmp_path / "press.recording"
    write_recording(entries, path)
    with open_recording(path) as source:
        begin_utc_s = round(source.begin_utc_s, 5)
    for start_s, named in ((begin_utc_s, True), (begin_utc_s + 1.0, False)):
        force = calibration.force.model_copy(update={"recordings_utc_s": [start_s]})
        save(calibration.model_copy(update={"force": force}), tmp_path / "calibration.toml")
        done = pneuforce("evaluate", path, "--calibration", tmp_path / "calibration.toml", "--json")
        assert done.returncode == 0, done.stderr
        assert ("calibration was made from this recording" in json.loads(done.stdout)["remark"]) is named


def drawn(recording, out, config=None, **options):
    """Return the texts of a plot, and the number of its stars at ΔP_f."""
    plot(PlotOptions(recording, out, overwrite=True, **options), config)
    figure = ET.parse(out).getroot()
    texts = ["".join(text.itertext()) for text in figure.iter(f"{SVG}text")]
    return texts, len(figure.findall(f".//{SVG}g[@id='ΔP_f']//{SVG}use"))


def test_a_plot_with_a_configuration_shows_the_evaluated_forces(recording, config, tmp_path):
    contacts = json.loads(pneuforce("evaluate", recording, "--config", config, "--json").stdout)["contacts"]
    percents = [
        100 * contact["force_std_n"] / contact["force_n"]
        for contact in contacts
        if contact["final_kpa"] - contact["baseline_kpa"] >= 0.5 and contact["state"] != "open"
    ]
    mean, out = f"{sum(percents) / len(percents):.2f}", tmp_path / "a.svg"
    texts, _ = drawn(recording, out, config, by_pressure=True)
    assert mean in texts
    assert any(config.name in text for text in texts)
    assert mean not in drawn(recording, out, by_pressure=True)[0]
    assert drawn(recording, out, config)[1] == len(contacts)


@pytest.mark.parametrize(("method", "colours"), [("energetic", 2), ("lulevich", 1)])
def test_only_the_energetic_method_has_two_colours_of_bars(recording, tmp_path, method, colours):
    config, out = tmp_path / "instrument.toml", tmp_path / "a.svg"
    config.write_text(f'[measurement]\nmethod = "{method}"\n')
    drawn(recording, out, config, by_pressure=True)
    fills = set(re.findall(r"fill: (#[0-9a-f]{6})", out.read_text())) & {YELLOW, BLUE}
    assert len(fills) == colours


def test_a_plot_of_a_part_has_the_contacts_of_this_part(recording, config, tmp_path):
    contacts = json.loads(pneuforce("evaluate", recording, "--config", config, "--json").stdout)["contacts"]
    out = tmp_path / "a.svg"
    assert drawn(recording, out, config, to_s=contacts[-1]["begin_s"] - 0.1)[1] == len(contacts) - 1


def with_reference(recording, reference, *words):
    """Evaluate the recording with its own configuration and a reference."""
    done = pneuforce("evaluate", recording, "--reference", reference, "--offset", "0", *words, "--json")
    assert done.returncode in (0, 1), done.stderr
    return done.returncode, json.loads(done.stdout)


@pytest.mark.parametrize(("factor", "within"), [(1.0, True), (2.9, False)])
def test_the_share_of_contacts_within_2u_of_a_reference_is_shown(recording, tmp_path, factor, within):
    with open_recording(recording) as source:
        rows = [
            f"{m.t_s - source.begin_s:.6f},{factor * m.force_n:.5f}\n"
            for m in source.samples()
            if math.isfinite(m.force_n)
        ]
    reference = tmp_path / "cell.csv"
    reference.write_text("".join(["t_s,force_n\n", *dict.fromkeys(rows)]))
    table = tmp_path / "contacts.csv"
    words = ("--reference-gain-percent", "0.5", "--contacts", table)
    returncode, facts = with_reference(recording, reference, *words)
    rows = facts["reference"]["contacts"]
    errors_n = [row["force_n"] - row["reference_n"] for row in rows]
    assert facts["reference"]["with_force"] == len(rows)
    assert facts["reference"]["mean_error_n"] == pytest.approx(sum(errors_n) / len(rows))
    squares = [error_n**2 for error_n in errors_n]
    assert facts["reference"]["rmse_n"] == pytest.approx(math.sqrt(sum(squares) / len(rows)))
    written = [row["plateau_reference_n"] for row in csv.DictReader(table.read_text().splitlines())]
    assert [float(cell) for cell in written if cell] == [row["reference_n"] for row in rows]
    assert returncode == 0
    assert rows
    assert facts["reference"]["within_2u"] == (len(rows) if within else 0)
    assert all(row["reference_n"] == pytest.approx(factor * row["force_n"], rel=0.01) for row in rows)
    assert all(row["reference_std_n"] >= 0.005 * row["reference_n"] for row in rows)


@pytest.mark.parametrize("count", [2, 33])
def test_the_forces_of_each_plateau_are_printed(count):
    rows = [PairedContact(8.0, 9.2, 1.5, 0.01, number, 2.0 * number) for number in range(1, count + 1)]
    forces = PlateauForces(rows)
    for row in rows:
        forces.add(row.plateau_begin_s, math.nan if row.contact == 2 else 1.5 + row.contact / 100, 0.1)
    aligned = AlignedReference(None, ClockOffset(0.0, 1.0), True, math.nan, False, ())
    lines = list(ReferenceComparison(aligned, forces).summary())
    assert any(
        re.search(r"^ +1 +2\.00 s +1\.510 ± 0\.100 N +1\.500 ± 0\.010 N +\+0\.010 N", line) for line in lines
    )
    assert sum(" ± 0.010 N " in line for line in lines) == min(count - 1, 30)
    assert any(line.startswith("and 2 more contacts") for line in lines) == (count == 33)
    assert not any("nan" in line for line in lines)


def test_each_contact_that_is_not_compared_is_named_with_the_reason(recording, tmp_path):
    reference = tmp_path / "cell.csv"
    reference.write_text("t_s,force_n\n" + "".join(f"{n / 10},1.0\n" for n in range(20)))
    _, facts = with_reference(recording, reference)
    left_out = facts["reference"]["left_out"]
    compared = [row["contact"] for row in facts["reference"]["contacts"]]
    assert len(left_out) > 0
    assert sorted([*compared, *(row["contact"] for row in left_out)]) == [
        row["number"] for row in facts["contacts"]
    ]
    assert all(row["reason"] for row in left_out)
    assert facts["reference"]["correlation"] is None
    assert "constant" in facts["reference"]["warnings"][0]
    options = ("--reference", reference, "--offset", "0")
    text = pneuforce("evaluate", recording, *options).stdout
    assert "nan" not in text
    assert [
        row for row in left_out if f"contact {row['contact']} at {row['begin_s']:.2f} s" not in text
    ] == []
