"""Tests of the event log file: records are only appended, by one writer; other files are rejected."""

import os
import shutil
import sqlite3
import stat
import subprocess
import sys
from contextlib import closing

import pytest

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.audit.reading import open_event_log
from pneuforce.instrument.audit.store import EventLogFile, EventLogFileError
from tests.instrument.audit.event_log_files import make_log, verify_log


def contents_of(folder):
    """Return the names and contents of all files in a folder."""
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def execute(path, *statements):
    with closing(sqlite3.connect(path)) as db:
        for statement in statements:
            db.execute(statement)
        db.commit()


def test_a_log_is_continued_after_it_was_closed(tmp_path):
    file = make_log(tmp_path / "log", range(3))
    first = verify_log(file)
    again = verify_log(make_log(file, range(3, 7)), head=first.head)
    assert (first.records, again.records) == (3, 7)


def test_each_commit_is_synced_to_the_disk(tmp_path):
    """Only a power cut could show an unsynced commit. Therefore the setting is checked: 2 means FULL."""
    log = EventLogFile(tmp_path / "log")
    assert log._db.execute("PRAGMA synchronous").fetchone() == (2,)
    assert log._db.execute("PRAGMA journal_mode").fetchone() == ("wal",)
    log.close()


def test_only_its_user_can_read_a_new_log_and_its_side_files(tmp_path):
    umask = os.umask(0)  # so that only the program limits the permissions
    try:
        log = EventLogFile(tmp_path / "log")
        log.append([b"{}"])
        modes = {path.name: stat.S_IMODE(path.stat().st_mode) for path in tmp_path.iterdir()}
        log.close()
    finally:
        os.umask(umask)
    assert modes == dict.fromkeys(("log", "log-wal", "log-shm"), 0o600)


@pytest.mark.parametrize(
    "statement",
    ["UPDATE records SET body = '{}'", "DELETE FROM records", "DELETE FROM records WHERE number = 3"],
)
def test_triggers_prevent_changes_and_deletions(tmp_path, statement):
    file = make_log(tmp_path / "log", range(3))
    with pytest.raises(sqlite3.IntegrityError, match="append only"):
        execute(file, statement)
    assert verify_log(file).records == 3


def test_reading_changes_no_file(tmp_path):
    file = make_log(tmp_path / "log", range(3))
    before = contents_of(tmp_path)
    assert verify_log(file).records == 3
    assert contents_of(tmp_path) == before


def test_a_log_is_readable_while_it_is_written(tmp_path):
    log = EventLogFile(tmp_path / "log")
    for number in range(3):
        log.append([b'{"n":%d}' % number])
        assert verify_log(tmp_path / "log").records == number + 1
    log.close()


def test_reading_starts_at_the_given_number(tmp_path):
    file = make_log(tmp_path / "log", range(5))
    with open_event_log(file, first=4) as rows:
        assert [row.number for row in rows] == [4, 5]


def test_the_database_of_another_program_is_rejected_and_not_changed(tmp_path):
    file = tmp_path / "log"
    execute(file, "CREATE TABLE other (a)")
    before = contents_of(tmp_path)
    with pytest.raises(EventLogFileError, match="database of another program"):
        EventLogFile(file)
    assert contents_of(tmp_path) == before


def test_another_version_is_rejected(tmp_path):
    file = make_log(tmp_path / "log", range(3))
    execute(file, "PRAGMA user_version = 2")
    with pytest.raises(EventLogFileError, match=r"version 2, .* version 1"):
        EventLogFile(file)


def test_a_file_that_is_not_a_database_is_rejected_and_not_changed(tmp_path):
    file = tmp_path / "log"
    file.write_text("some notes\n" * 100)
    with pytest.raises(EventLogFileError, match="not an event log"):
        EventLogFile(file)
    assert file.read_text() == "some notes\n" * 100


@pytest.mark.parametrize("digest", ["NULL", "'text'", "5", "x'00'"])
def test_a_log_whose_last_record_has_no_digest_is_rejected(tmp_path, digest):
    """A truncated file can contain such a record, because SQLite does not detect all damage."""
    file = make_log(tmp_path / "log", range(2))
    execute(
        file,
        "ALTER TABLE records RENAME TO original",
        "CREATE TABLE records (number INTEGER PRIMARY KEY, body, digest)",
        f"INSERT INTO records SELECT number, body, {digest} FROM original",
    )
    with pytest.raises(EventLogFileError, match="record 2 has no digest"):
        EventLogFile(file)


@pytest.mark.parametrize(("name", "message"), [("", "folder"), ("/dev/null", "not a regular file")])
def test_a_path_that_is_not_a_regular_file_is_rejected(tmp_path, name, message):
    with pytest.raises(EventLogFileError, match=message):
        EventLogFile(tmp_path / name)


def test_a_second_writer_of_the_same_file_is_rejected_and_changes_nothing(tmp_path):
    file = tmp_path / "log"
    log = EventLogFile(file)
    log.append([b"{}"])
    script = (
        "from pathlib import Path\n"
        "from pneuforce.instrument.audit.store import EventLogFile\n"
        f"EventLogFile(Path({str(file)!r}))"
    )
    second = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert "is written by another running instrument" in second.stderr
    log.append([b"{}"])
    assert verify_log(file).records == 2
    log.close()
    assert verify_log(file).records == 2


def test_reading_an_empty_file_keeps_the_wal_file_beside_it(tmp_path):
    log = EventLogFile(tmp_path / "log")
    log.append([b"{}"])
    for name in ("log-wal", "log-shm"):
        shutil.copy(tmp_path / name, tmp_path / f"empty{name.removeprefix('log')}")
    log.close()
    (tmp_path / "empty").touch()
    before = contents_of(tmp_path)
    assert verify_log(tmp_path / "empty").records == 0
    assert contents_of(tmp_path) == before


def test_the_wal_file_of_a_moved_log_is_not_deleted(tmp_path):
    killed, log = tmp_path / "killed", EventLogFile(tmp_path / "log")
    log.append([b"{}"])
    killed.mkdir()
    shutil.copy(tmp_path / "log", killed / "2026")
    shutil.copy(tmp_path / "log-wal", killed / "log-wal")
    log.close()
    with pytest.raises(
        EventLogFileError, match="log-wal contains records of an event log that was moved without"
    ):
        EventLogFile(killed / "log")
    assert not (killed / "log").exists()  # an empty file would make SQLite delete the -wal file
    (killed / "log-wal").rename(killed / "2026-wal")
    assert verify_log(killed / "2026").records == 1
    EventLogFile(killed / "log").close()


def test_a_missing_log_is_reported_and_not_created(tmp_path):
    with pytest.raises(ConfigurationError, match="does not exist"):
        verify_log(tmp_path / "log")
    assert contents_of(tmp_path) == {}
