"""Killed at any moment, cut at any byte, garbled anywhere: what is left is true, or said to be broken."""

import random
import shutil
import sqlite3
import subprocess
import sys
import time
from datetime import datetime

import pytest

from instrument.cli.event_table import Choice, show_events
from instrument.errors import ConfigurationError
from instrument.events.reading import Damaged
from instrument.events.store import NotOurs, Store
from instrument.events.verification import Broken
from tests.instrument.events.keeping import chain_of, written

RECORDS = 60
APPEND = """
import os, sys
from pathlib import Path
from instrument.events.store import Store
store, count = Store(Path(sys.argv[1])), int(sys.argv[2])
store._db.execute("PRAGMA wal_autocheckpoint = 20")
for number in range(count):
    store.append([b'{"at":"%d","padding":"%s"}' % (number, b"x" * 300)])
    print(number + 1, store.head.hex(), flush=True)
os._exit(0)
"""


def appending(file, count):
    return subprocess.Popen(
        [sys.executable, "-c", APPEND, str(file), str(count)], stdout=subprocess.PIPE, text=True
    )


@pytest.fixture(scope="module")
def killed(tmp_path_factory):
    """A log as a kill leaves it: part of it in the file, part in its -wal; and the head after each record."""
    file = tmp_path_factory.mktemp("killed") / "log"
    told, _ = appending(file, RECORDS).communicate(timeout=60)
    heads = dict(line.split() for line in told.splitlines())
    assert len(heads) == RECORDS
    assert file.with_name("log-wal").stat().st_size > 10_000 < file.stat().st_size
    return file, {int(number): head for number, head in heads.items()}


def copied(file, folder):
    """A copy of the file and its -wal, as somebody would take it home."""
    for end in ("", "-wal"):
        shutil.copyfile(f"{file}{end}", folder / f"log{end}")
    return folder / "log"


def test_no_record_is_lost_that_was_said_to_be_kept_though_the_process_is_killed(tmp_path):
    chance, file, before = random.Random(7), tmp_path / "log", 0
    for _ in range(6):
        process = appending(file, 1_000_000)
        first = int(process.stdout.readline().split()[0])
        time.sleep(chance.uniform(0.0, 0.15))
        process.kill()
        last = [line for line in process.stdout.read().splitlines() if len(line.split()) == 2]
        kept = before + (int(last[-1].split()[0]) if last else first)
        chain = chain_of(file)
        assert kept <= chain.records <= kept + 1
        before = chain.records
    assert before > 6


def test_a_killed_log_is_read_whole_beside_its_wal_and_from_a_copy(killed, tmp_path):
    file, heads = killed
    for path in (file, copied(file, tmp_path)):
        assert chain_of(path).head == heads[RECORDS]
    assert {path.name for path in tmp_path.iterdir()} == {"log", "log-wal"}


def test_a_log_that_would_run_something_when_it_is_read_is_refused(tmp_path):
    file = written(tmp_path / "log", range(3))
    db = sqlite3.connect(file)
    db.executescript("""
        DROP TABLE records;
        CREATE VIEW records AS WITH RECURSIVE endless(i) AS (SELECT 1 UNION ALL SELECT i FROM endless)
        SELECT i AS number, i AS body, i AS seal FROM endless;
    """)
    db.close()
    with pytest.raises(ConfigurationError, match="more than plain tables of rows"):
        chain_of(file)


def test_a_record_nested_without_end_is_shown_as_what_cannot_be_read(tmp_path, capsys):
    store = Store(tmp_path / "log")
    store.append([b"[" * 200_000])
    store.close()
    for as_json in (False, True):
        show_events(tmp_path / "log", Choice(since=datetime(1, 1, 1)), as_json)
        show_events(tmp_path / "log", Choice(), as_json)
    assert "unreadable" in capsys.readouterr().out
    assert chain_of(tmp_path / "log").records == 1


def test_a_wal_that_is_cut_loses_its_last_records_and_no_more(killed, tmp_path):
    file, heads = killed
    copy, chance = copied(file, tmp_path), random.Random(11)
    whole = copy.with_name("log-wal").read_bytes()
    seen = set()
    for size in sorted(chance.sample(range(len(whole)), 40), reverse=True):
        copy.with_name("log-wal").write_bytes(whole[:size])
        try:
            chain = chain_of(copy)
        except (Damaged, Broken):  # a cut that SQLite's own checkpoint could never leave behind
            continue
        assert chain.records == 0 or chain.head == heads[chain.records]
        seen.add(chain.records)
    assert len(seen) > 5


@pytest.mark.parametrize("end", ["", "-wal"])
@pytest.mark.parametrize("how", ["cut", "a bit", "a stretch"])
def test_a_damaged_copy_is_never_taken_for_another_truth(killed, tmp_path, end, how):
    file, heads = killed
    copy, chance = copied(file, tmp_path), random.Random(f"{end} {how}")
    part = copy.with_name(f"log{end}")
    whole = part.read_bytes()
    verdicts = set()
    for _ in range(30):
        part.write_bytes(damaged(whole, how, chance))
        try:
            chain = chain_of(copy)
        except (Damaged, Broken, ConfigurationError) as error:
            verdicts.add(type(error))
            continue
        verdicts.add("unbroken")
        assert chain.records == 0 or chain.head == heads[chain.records]
    assert verdicts


def damaged(data, how, chance):
    at = chance.randrange(len(data))
    if how == "cut":
        return data[:at]
    if how == "a bit":
        return data[:at] + bytes((data[at] ^ 1 << chance.randrange(8),)) + data[at + 1 :]
    return data[:at] + chance.randbytes(200) + data[at + 200 :]


def test_an_instrument_goes_on_after_a_torn_end_or_says_why_not(killed, tmp_path):
    file, _ = killed
    whole = file.with_name("log-wal").read_bytes()
    went_on = 0
    for size in range(len(whole) - 1, 0, -len(whole) // 12):
        folder = tmp_path / str(size)
        folder.mkdir()
        copy = copied(file, folder)
        copy.with_name("log-wal").write_bytes(whole[:size])
        try:
            store = Store(copy)
        except NotOurs:
            continue
        store.append([b'{"at":"later"}'])
        store.close()
        try:
            assert chain_of(copy).records >= 1
            went_on += 1
        except Broken:
            continue
    assert went_on > 5


def test_who_only_read_the_tail_of_a_garbled_log_is_told_by_verify(killed, tmp_path):
    file, _ = killed
    copy = copied(file, tmp_path)
    copy.with_name("log-wal").write_bytes(b"")
    body = copy.read_bytes()
    at = body.index(b'"at":"5"')
    copy.write_bytes(body[:at] + b'"at":"6"' + body[at + 8 :])
    with pytest.raises(Broken, match=r"^record 6 "):
        chain_of(copy)
