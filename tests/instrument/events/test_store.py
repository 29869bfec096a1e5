"""The file: it only grows, it belongs to one instrument, and it is told from others."""

import shutil
import sqlite3
import subprocess
import sys
from contextlib import closing

import pytest

from instrument.errors import ConfigurationError
from instrument.events.reading import opened
from instrument.events.store import NotOurs, Store
from tests.instrument.events.keeping import chain_of, written


def lying(folder):
    """What lies in a folder: names and contents."""
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def altered(path, *statements):
    with closing(sqlite3.connect(path)) as db:
        for statement in statements:
            db.execute(statement)
        db.commit()


def test_a_log_goes_on_where_it_ended(tmp_path):
    file = written(tmp_path / "log", range(3))
    first = chain_of(file)
    again = chain_of(written(file, range(3, 7)), head=first.head)
    assert (first.records, again.records) == (3, 7)


def test_sqlite_waits_for_the_disk_at_each_commit(tmp_path):
    """Nothing short of a power cut shows it; 2 is FULL."""
    store = Store(tmp_path / "log")
    assert store._db.execute("PRAGMA synchronous").fetchone() == (2,)
    assert store._db.execute("PRAGMA journal_mode").fetchone() == ("wal",)
    store.close()


@pytest.mark.parametrize(
    "statement",
    ["UPDATE records SET body = '{}'", "DELETE FROM records", "DELETE FROM records WHERE number = 3"],
)
def test_sql_can_neither_change_nor_delete_a_record(tmp_path, statement):
    file = written(tmp_path / "log", range(3))
    with pytest.raises(sqlite3.IntegrityError, match="append only"):
        altered(file, statement)
    assert chain_of(file).records == 3


def test_reading_leaves_everything_as_it_was(tmp_path):
    file = written(tmp_path / "log", range(3))
    before = lying(tmp_path)
    assert chain_of(file).records == 3
    assert lying(tmp_path) == before


def test_a_log_is_read_while_it_is_written(tmp_path):
    store = Store(tmp_path / "log")
    for number in range(3):
        store.append([b'{"n":%d}' % number])
        assert chain_of(tmp_path / "log").records == number + 1
    store.close()


def test_only_what_is_asked_for_is_read(tmp_path):
    file = written(tmp_path / "log", range(5))
    with opened(file, first=4) as rows:
        assert [row.number for row in rows] == [4, 5]


def test_another_programs_database_is_refused_and_left_alone(tmp_path):
    file = tmp_path / "log"
    altered(file, "CREATE TABLE theirs (a)")
    before = lying(tmp_path)
    with pytest.raises(NotOurs, match="another program's database"):
        Store(file)
    assert lying(tmp_path) == before


def test_another_version_is_refused(tmp_path):
    file = written(tmp_path / "log", range(3))
    altered(file, "PRAGMA user_version = 2")
    with pytest.raises(NotOurs, match="version 2, this is version 1"):
        Store(file)


def test_what_is_no_database_is_refused_and_left_alone(tmp_path):
    file = tmp_path / "log"
    file.write_text("notes of mine\n" * 100)
    with pytest.raises(NotOurs, match="no event log"):
        Store(file)
    assert file.read_text() == "notes of mine\n" * 100


@pytest.mark.parametrize("seal", ["NULL", "'text'", "5", "x'00'"])
def test_a_log_whose_last_record_has_no_seal_is_refused(tmp_path, seal):
    """As may be read from a file whose end was cut off; in such a one SQLite does not find every damage."""
    file = written(tmp_path / "log", range(2))
    altered(
        file,
        "ALTER TABLE records RENAME TO were",
        "CREATE TABLE records (number INTEGER PRIMARY KEY, body, seal)",
        f"INSERT INTO records SELECT number, body, {seal} FROM were",
    )
    with pytest.raises(NotOurs, match=r"move it away \(record 2 has no seal\)"):
        Store(file)


@pytest.mark.parametrize(("name", "said"), [("", "folder"), ("/dev/null", "not a regular file")])
def test_what_is_no_file_is_refused(tmp_path, name, said):
    with pytest.raises(NotOurs, match=said):
        Store(tmp_path / name)


def test_a_second_instrument_on_the_same_file_is_refused_and_harms_nothing(tmp_path):
    file = tmp_path / "log"
    store = Store(file)
    store.append([b"{}"])
    script = (
        f"from pathlib import Path\nfrom instrument.events.store import Store\nStore(Path({str(file)!r}))"
    )
    second = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert "is written by another instrument that runs" in second.stderr
    store.append([b"{}"])
    assert chain_of(file).records == 2
    store.close()
    assert chain_of(file).records == 2


def test_reading_an_empty_file_takes_nothing_from_beside_it(tmp_path):
    store = Store(tmp_path / "log")
    store.append([b"{}"])
    for name in ("log-wal", "log-shm"):
        shutil.copy(tmp_path / name, tmp_path / f"empty{name.removeprefix('log')}")
    store.close()
    (tmp_path / "empty").touch()
    before = lying(tmp_path)
    assert chain_of(tmp_path / "empty").records == 0
    assert lying(tmp_path) == before


def test_what_a_killed_instrument_left_beside_a_log_that_was_moved_is_not_thrown_away(tmp_path):
    killed, store = tmp_path / "killed", Store(tmp_path / "log")
    store.append([b"{}"])
    killed.mkdir()
    shutil.copy(tmp_path / "log", killed / "2026")
    shutil.copy(tmp_path / "log-wal", killed / "log-wal")
    store.close()
    with pytest.raises(NotOurs, match="log-wal holds records of a log that was moved without it"):
        Store(killed / "log")
    assert not (killed / "log").exists()  # whoever opened an empty one would delete what lies beside it
    (killed / "log-wal").rename(killed / "2026-wal")
    assert chain_of(killed / "2026").records == 1
    Store(killed / "log").close()


def test_a_log_that_is_not_there_is_a_sentence_and_is_not_made(tmp_path):
    with pytest.raises(ConfigurationError, match="no such file"):
        chain_of(tmp_path / "log")
    assert lying(tmp_path) == {}
