"""Tests of `pneuforce export --contacts`: one row per contact, with its force and its end."""

import csv
import json
import math

import pyarrow.parquet as pq
import pytest

from pneuforce.instrument.recording.contact_table import CONTACT_TYPES, collect_contacts, relative_contacts
from pneuforce.instrument.recording.contacts import ContactHistory
from pneuforce.instrument.recording.opening import open_recording
from tests.command_runner import pneuforce
from tests.instrument.recording.recorded_story import hold, press, record_story

TUBE_TIME_CONSTANT_S = 0.06


def vent_during_a_contact(harness, _):
    hold(harness)
    harness.push_kpa = 1.5
    harness.renew(1.0)
    harness.instrument.vent(harness.now_s)
    harness.run(1.0)


@pytest.fixture(scope="module")
def pressed(tmp_path_factory):
    return record_story(tmp_path_factory.mktemp("pressed") / "press.recording", press)


def samples_of(path):
    with open_recording(path) as recording:
        return list(recording.samples())


def exported(recording, out, *words):
    done = pneuforce("export", recording, out, "--contacts", *words)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_table_has_the_contacts_of_the_plot_and_of_the_page(pressed, tmp_path):
    assert "4 contacts" in exported(pressed, tmp_path / "contacts.csv")
    with (tmp_path / "contacts.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == list(CONTACT_TYPES)
    with open_recording(pressed) as recording:
        begin_s = recording.begin_s
    for row, expected in zip(rows, history_of(samples_of(pressed)), strict=True):
        assert float(row["begin_s"]) == pytest.approx(expected.begin_s - begin_s, abs=1e-5)
        assert float(row["end_s"]) - float(row["begin_s"]) == pytest.approx(expected.duration_s, abs=1e-5)
        assert float(row["baseline_kpa"]) == expected.baseline_kpa
        assert float(row["final_kpa"]) == expected.final_kpa
        assert float(row["force_n"]) == expected.peak_n
        assert float(row["force_std_n"]) == expected.peak_std_n
        assert (row["state"], row["reason"]) == ("ended", "")
    rises_kpa = [float(row["final_kpa"]) - float(row["baseline_kpa"]) for row in rows]
    assert [row["touch_only"] for row in rows] == [str(int(rise_kpa < 0.5)) for rise_kpa in rises_kpa]
    assert {row["touch_only"] for row in rows} == {"0", "1"}


def test_a_contact_at_the_start_of_a_recording_begins_at_zero_and_not_at_minus_zero(pressed):
    contact = collect_contacts(samples_of(pressed), TUBE_TIME_CONSTANT_S)[0]
    [relative] = relative_contacts(contact.begin_s + 4e-7, [contact])
    assert math.copysign(1.0, relative.begin_s) == 1.0


def test_parquet_has_types_and_json_has_the_number_of_contacts(pressed, tmp_path):
    facts = json.loads(exported(pressed, tmp_path / "contacts.parquet", "--json"))
    assert facts["contacts"] == 4
    assert (facts["ok"], facts["code"], facts["exit_code"], facts["fault"]) == (True, "done", 0, None)
    table = pq.read_table(tmp_path / "contacts.parquet")
    assert table.column_names == list(CONTACT_TYPES)
    assert table.column("state").to_pylist() == ["ended"] * 4
    assert all(force_n > 0 for force_n in table.column("force_n").to_pylist())


def test_a_contact_that_did_not_end_by_itself_has_another_state(pressed, tmp_path):
    samples = samples_of(pressed)
    in_contact = [number for number, m in enumerate(samples) if m.in_contact]
    middle = in_contact[len(in_contact) // 8]
    [only] = collect_contacts(samples[:middle], TUBE_TIME_CONSTANT_S)
    assert only.state == "open"
    later = [m._replace(t_s=m.t_s + 5.0) for m in samples[middle:]]
    first, second, *_ = collect_contacts(samples[:middle] + later, TUBE_TIME_CONSTANT_S)
    assert (first.state, second.state) == ("interrupted", "cut")
    vented = samples_of(record_story(tmp_path / "vented.recording", vent_during_a_contact))
    assert [contact.state for contact in collect_contacts(vented, TUBE_TIME_CONSTANT_S)] == ["vented"]


def test_a_contact_that_began_before_the_table_is_cut(pressed, tmp_path):
    [first, *_] = collect_contacts(samples_of(pressed), TUBE_TIME_CONSTANT_S)
    with open_recording(pressed) as recording:
        middle_s = first.begin_s + first.duration_s / 2 - recording.begin_s
    exported(pressed, tmp_path / "part.csv", "--from-s", str(middle_s))
    with (tmp_path / "part.csv").open() as file:
        states = [row["state"] for row in csv.DictReader(file)]
    assert states == ["cut", "ended", "ended", "ended"]


def test_a_contact_without_a_force_has_the_reason(pressed):
    no_force = [
        m._replace(force_n=float("nan"), force_std_n=float("nan"), quality=32) if m.in_contact else m
        for m in samples_of(pressed)
    ]
    for contact in collect_contacts(no_force, TUBE_TIME_CONSTANT_S):
        assert contact.force_n != contact.force_n
        assert "no_baseline" in contact.reason.split()


def test_a_contact_whose_highest_samples_have_no_force_has_neither_force_nor_uncertainty(pressed):
    """The contact begins below the table of the method membrane, and ends above the table."""
    samples = samples_of(pressed)
    limit_kpa = max(m.rise_kpa for m in samples if m.in_contact) / 2
    unsolved = {"force_n": float("nan"), "force_std_n": float("nan"), "quality": 4}
    cut = [m._replace(**unsolved) if m.in_contact and m.rise_kpa > limit_kpa else m for m in samples]
    contacts = collect_contacts(cut, TUBE_TIME_CONSTANT_S)
    assert {contact.reason for contact in contacts} == {"no_solution", ""}
    for contact in contacts:
        missing = [value != value for value in (contact.force_n, contact.force_std_n)]
        assert missing == [bool(contact.reason)] * 2
    peaks = [row for row in history_of(cut) if row.peak_n != row.peak_n or row.peak_std_n != row.peak_std_n]
    assert all(row.peak_n != row.peak_n and row.peak_std_n != row.peak_std_n for row in peaks)


def history_of(samples):
    history = ContactHistory()
    for m in samples:
        history.add_sample(m)
    return history.rows


def test_an_exported_file_is_replaced_only_on_request(pressed, tmp_path):
    out = tmp_path / "contacts.csv"
    out.write_text("old")
    refused = pneuforce("export", pressed, out, "--contacts")
    assert refused.returncode == 2
    assert "--overwrite" in refused.stderr
    assert out.read_text() == "old"
    exported(pressed, out, "--overwrite")
    assert out.read_text() != "old"
    rejected = pneuforce("export", pressed, tmp_path / "b.csv", "--contacts", "--format", "validation")
    assert rejected.returncode == 2
