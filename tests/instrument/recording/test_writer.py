"""Tests of the files that the recording writer creates."""

import os
import re
import sqlite3
import stat
from pathlib import Path

import pytest

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.recording.schema import TABLES, EndReason
from pneuforce.instrument.recording.writer import RecordingWriteError, RecordingWriter
from pneuforce.instrument.stream.entry import EntryKind, StreamEntry, StreamError, json_entry
from pneuforce.instrument.stream.sample_record import SampleRecord
from tests.instrument.recording.recording_files import (
    BEGIN_S,
    DT_S,
    HEADER,
    add_entries,
    begin_recording,
    comparable,
    expected_contents,
    make_entries,
    make_recording,
    read_contents,
)

COUNT = 1234
#: Expected settings of SQLite. A sync every 200 pages limits the loss at a power cut to about five seconds.
PRAGMAS = {
    "journal_mode": "wal",
    "journal_size_limit": 8_000_000,
    "synchronous": 1,  # NORMAL
    "wal_autocheckpoint": 200,
}
TOP = Path(__file__).parents[3]


@pytest.fixture
def path(tmp_path):
    return tmp_path / "a.recording"


def test_all_entries_are_read_back_bit_for_bit(path):
    make_recording(path, COUNT)
    contents, expected = read_contents(path), expected_contents(COUNT)
    assert contents.metadata == {**HEADER, "begin_s": BEGIN_S}
    assert contents.checkpoint == StreamEntry(EntryKind.CHECKPOINT, BEGIN_S, b"state" * 999)
    assert contents.inputs == expected.inputs
    assert comparable(contents.samples) == comparable(expected.samples)
    assert contents.events == expected.events
    assert contents.ending == (BEGIN_S + COUNT * DT_S, EndReason.STOPPED, "", COUNT)
    assert contents.remark == ""


def test_a_recording_with_a_normal_end_is_one_file(path):
    make_recording(path, COUNT)
    assert os.listdir(path.parent) == [path.name]


def test_every_field_of_a_sample_is_a_column_with_its_type(path):
    make_recording(path, 7)
    db = sqlite3.connect(path)
    columns = {name: kind for _, name, kind, *_ in db.execute("PRAGMA table_info(samples)")}
    assert list(columns) == ["number", *SampleRecord._fields, "crc32"]
    assert (columns["t_s"], columns["sequence"], columns["in_contact"]) == ("REAL", "INTEGER", "INTEGER")
    (stored,) = db.execute("SELECT typeof(t_s), force_n FROM samples WHERE number = 7").fetchall()
    assert stored == ("real", 1.0)
    db.close()


def test_the_document_names_every_table_and_column():
    documented = set(re.findall(r"`(\w+)`", (TOP / "docs/recordings.md").read_text(encoding="utf-8")))
    assert {
        *TABLES,
        *SampleRecord._fields,
        *(name for columns in TABLES.values() for name in columns),
    } <= documented


def test_a_quantity_that_is_not_available_is_null(path):
    make_recording(path, 10)
    db = sqlite3.connect(path)
    assert db.execute("SELECT number FROM samples WHERE force_n IS NULL").fetchall() == [(5,), (10,)]
    db.close()


def test_a_recording_is_readable_while_it_is_written(path):
    file = begin_recording(path)
    add_entries(file, make_entries(500))
    half = read_contents(path)
    add_entries(file, make_entries(500, first=501))
    assert len(half.samples) == 500
    assert "no end" in half.remark
    assert "500 samples are intact" in half.remark
    assert comparable(read_contents(path).samples) == comparable(expected_contents(1000).samples)
    file.close()


def test_entries_that_are_not_committed_are_lost_at_close(path):
    file = begin_recording(path)
    add_entries(file, make_entries(100))
    for entry in make_entries(50, first=101):
        file.add_entry(entry)
    file.close()
    contents = read_contents(path)
    assert (len(contents.samples), contents.inputs) == (100, expected_contents(100).inputs)


def test_the_sqlite_settings_limit_the_loss_at_a_power_cut(path):
    file = begin_recording(path)
    settings = {name: file._db.execute(f"PRAGMA {name}").fetchone()[0] for name in PRAGMAS}
    assert settings == PRAGMAS
    file.close()


def test_only_the_owner_can_read_a_recording(path):
    file = begin_recording(path)
    modes = {stat.S_IMODE(there.stat().st_mode) for there in path.parent.iterdir()}
    assert modes == {0o600}
    file.close()


@pytest.mark.parametrize("suffix", ["", "-wal", "-shm", "-journal"])
def test_an_existing_file_is_not_overwritten(path, suffix):
    existing = path.with_name(path.name + suffix)
    existing.write_bytes(b"something")
    with pytest.raises(ConfigurationError, match="exists already"):
        RecordingWriter(path)
    assert {file.name: file.read_bytes() for file in path.parent.iterdir()} == {existing.name: b"something"}


def test_a_broken_link_is_not_overwritten(path):
    path.symlink_to(path.parent / "elsewhere")
    with pytest.raises(ConfigurationError, match="exists already"):
        RecordingWriter(path)


@pytest.mark.parametrize("name", ["missing/a.recording", "."])
def test_a_path_that_cannot_be_created_is_reported(tmp_path, name):
    with pytest.raises(ConfigurationError, match=r"cannot be written|exists already"):
        RecordingWriter(tmp_path / name)


def test_a_removed_file_is_reported_at_the_next_commit(path):
    file = begin_recording(path)
    add_entries(file, make_entries(10))
    path.unlink()
    with pytest.raises(RecordingWriteError, match="removed"):
        add_entries(file, make_entries(10, first=11))
    assert file.committed_samples == 10
    file.close()


def test_a_discarded_recording_leaves_no_file(path):
    RecordingWriter(path).discard()
    assert os.listdir(path.parent) == []


@pytest.mark.parametrize(
    "entry",
    [
        json_entry(EntryKind.SNAPSHOT, 1.0, {}),
        StreamEntry(EntryKind.SAMPLE, 1.0, b"short"),
        StreamEntry(EntryKind.EVENT, 1.0, b"\xff"),
        json_entry(EntryKind.EVENT, 1.0, ["no", "object"]),
        StreamEntry(EntryKind.HEADER, 1.0, b"{"),
    ],
    ids=lambda entry: entry.kind.name,
)
def test_an_invalid_entry_is_rejected(path, entry):
    file = begin_recording(path)
    with pytest.raises(StreamError):
        file.add_entry(entry)
    file.close()
