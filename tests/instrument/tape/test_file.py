"""The file of a recording, as it is written."""

import os
import re
import sqlite3
import stat
from pathlib import Path

import pytest

from instrument.errors import ConfigurationError
from instrument.tape.entry import Entry, Kind, TapeError, told
from instrument.tape.file import TapeFile, Unwritable
from instrument.tape.measured import Measured
from instrument.tape.schema import TABLES, How
from tests.instrument.tape.taping import ABOUT, BEGIN_S, DT_S, begun, ended, entries, found, put, same, wanted

COUNT = 1234
#: Of SQLite's settings those on which docs/recordings.md relies: a sync every 200 pages, some five seconds.
PROMISED = {
    "journal_mode": "wal",
    "journal_size_limit": 8_000_000,
    "synchronous": 1,  # NORMAL
    "wal_autocheckpoint": 200,
}
TOP = Path(__file__).parents[3]


@pytest.fixture
def path(tmp_path):
    return tmp_path / "a.tape"


def test_all_that_was_put_down_is_read_back_to_the_last_bit(path):
    ended(path, COUNT)
    read, want = found(path), wanted(COUNT)
    assert read.about == {**ABOUT, "begin_s": BEGIN_S}
    assert read.checkpoint == Entry(Kind.CHECKPOINT, BEGIN_S, b"state" * 999)
    assert read.inputs == want.inputs
    assert same(read.samples) == same(want.samples)
    assert read.events == want.events
    assert read.ending == (BEGIN_S + COUNT * DT_S, How.STOPPED, "", COUNT)
    assert read.remark == ""


def test_a_recording_in_good_order_is_one_file(path):
    ended(path, COUNT)
    assert os.listdir(path.parent) == [path.name]


def test_every_field_of_a_sample_is_a_column_with_its_type(path):
    ended(path, 7)
    db = sqlite3.connect(path)
    columns = {name: kind for _, name, kind, *_ in db.execute("PRAGMA table_info(samples)")}
    assert list(columns) == ["number", *Measured._fields, "crc32"]
    assert (columns["t_s"], columns["sequence"], columns["in_contact"]) == ("REAL", "INTEGER", "INTEGER")
    (stored,) = db.execute("SELECT typeof(t_s), force_n FROM samples WHERE number = 7").fetchall()
    assert stored == ("real", 1.0)
    db.close()


def test_the_document_names_every_table_and_column():
    named = set(re.findall(r"`(\w+)`", (TOP / "docs/recordings.md").read_text(encoding="utf-8")))
    assert {*TABLES, *Measured._fields, *(name for columns in TABLES.values() for name in columns)} <= named


def test_what_is_not_available_is_null(path):
    ended(path, 10)
    db = sqlite3.connect(path)
    assert db.execute("SELECT number FROM samples WHERE force_n IS NULL").fetchall() == [(5,), (10,)]
    db.close()


def test_it_is_read_while_it_is_written_as_it_was_at_that_moment(path):
    file = begun(path)
    put(file, entries(500))
    with_half = found(path)
    put(file, entries(500, first=501))
    assert len(with_half.samples) == 500
    assert "no end" in with_half.remark
    assert "500 samples are whole" in with_half.remark
    assert same(found(path).samples) == same(wanted(1000).samples)
    file.close()


def test_what_is_not_committed_is_not_there(path):
    file = begun(path)
    put(file, entries(100))
    for entry in entries(50, first=101):
        file.put(entry)
    file.close()
    read = found(path)
    assert (len(read.samples), read.inputs) == (100, wanted(100).inputs)


def test_a_power_cut_costs_no_more_than_is_promised(path):
    file = begun(path)
    told_of = {name: file._db.execute(f"PRAGMA {name}").fetchone()[0] for name in PROMISED}
    assert told_of == PROMISED
    file.close()


def test_a_recording_is_for_its_owner_alone(path):
    file = begun(path)
    modes = {stat.S_IMODE(there.stat().st_mode) for there in path.parent.iterdir()}
    assert modes == {0o600}
    file.close()


@pytest.mark.parametrize("end", ["", "-wal", "-shm", "-journal"])
def test_nothing_that_is_there_is_written_over(path, end):
    there = path.with_name(path.name + end)
    there.write_bytes(b"something")
    with pytest.raises(ConfigurationError, match="there already"):
        TapeFile(path)
    assert {file.name: file.read_bytes() for file in path.parent.iterdir()} == {there.name: b"something"}


def test_a_link_to_nowhere_is_something_that_is_there(path):
    path.symlink_to(path.parent / "elsewhere")
    with pytest.raises(ConfigurationError, match="there already"):
        TapeFile(path)


@pytest.mark.parametrize("name", ["missing/a.tape", "."])
def test_where_no_file_can_be_made_a_sentence_says_so(tmp_path, name):
    with pytest.raises(ConfigurationError, match=r"cannot be made|there already"):
        TapeFile(tmp_path / name)


def test_a_file_that_was_taken_away_takes_no_more(path):
    file = begun(path)
    put(file, entries(10))
    path.unlink()
    with pytest.raises(Unwritable, match="taken away"):
        put(file, entries(10, first=11))
    assert file.kept == 10
    file.close()


def test_a_recording_that_never_began_leaves_nothing(path):
    TapeFile(path).discard()
    assert os.listdir(path.parent) == []


@pytest.mark.parametrize(
    "entry",
    [
        told(Kind.SNAPSHOT, 1.0, {}),
        Entry(Kind.MEASURED, 1.0, b"short"),
        Entry(Kind.EVENT, 1.0, b"\xff"),
        told(Kind.EVENT, 1.0, ["no", "table"]),
        Entry(Kind.BEGIN, 1.0, b"{"),
    ],
    ids=lambda entry: entry.kind.name,
)
def test_an_entry_that_no_instrument_puts_down_is_refused(path, entry):
    file = begun(path)
    with pytest.raises(TapeError):
        file.put(entry)
    file.close()
