"""Tests of damaged event logs: the records that can be read are correct, or an error is reported."""

import json
import random
import re
import shutil
import sqlite3
import subprocess
import sys
import time
from contextlib import closing
from datetime import datetime
from functools import partial

import pytest

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.audit.reading import DamagedLogError, repeated_if_changed
from pneuforce.instrument.audit.store import EventLogFile, EventLogFileError, check_event_log
from pneuforce.instrument.audit.verification import BrokenChainError
from pneuforce.instrument.cli.log.table import EventSelection, show_events
from pneuforce.instrument.cli.log.verification import Verification, verify_events
from tests.instrument.audit.event_log_files import make_log, verify_log
from tests.source_tree import ROOT
from tests.tools import needs

RECORDS = 60
APPEND = """
import os, sys
from pathlib import Path
from pneuforce.instrument.audit.store import EventLogFile
log, count = EventLogFile(Path(sys.argv[1])), int(sys.argv[2])
log._db.execute("PRAGMA wal_autocheckpoint = 20")
for number in range(count):
    log.append([b'{"at":"%d","padding":"%s"}' % (number, b"x" * 300)])
    print(number + 1, log.head.hex(), flush=True)
os._exit(0)
"""


def append_in_process(file, count):
    return subprocess.Popen(
        [sys.executable, "-c", APPEND, str(file), str(count)], stdout=subprocess.PIPE, text=True
    )


@pytest.fixture(scope="module")
def killed(tmp_path_factory):
    """Return the log of a killed process, and the head after each record.

    Some records are only in the -wal file.
    """
    file = tmp_path_factory.mktemp("killed") / "log"
    output, _ = append_in_process(file, RECORDS).communicate(timeout=60)
    heads = dict(line.split() for line in output.splitlines())
    assert len(heads) == RECORDS
    assert file.with_name("log-wal").stat().st_size > 10_000 < file.stat().st_size
    return file, {int(number): head for number, head in heads.items()}


def copy_log(file, folder):
    """Copy the file and its -wal file, without the -shm file."""
    for suffix in ("", "-wal"):
        shutil.copyfile(f"{file}{suffix}", folder / f"log{suffix}")
    return folder / "log"


def test_a_kill_loses_no_record_whose_append_returned(tmp_path):
    chance, file, before = random.Random(7), tmp_path / "log", 0
    for _ in range(6):
        process = append_in_process(file, 1_000_000)
        first = int(process.stdout.readline().split()[0])
        time.sleep(chance.uniform(0.0, 0.15))
        process.kill()
        last = [line for line in process.stdout.read().splitlines() if len(line.split()) == 2]
        appended = before + (int(last[-1].split()[0]) if last else first)
        chain = verify_log(file)
        assert appended <= chain.records <= appended + 1
        before = chain.records
    assert before > 6


def test_the_log_of_a_killed_process_and_its_copy_are_complete(killed, tmp_path):
    file, heads = killed
    for path in (file, copy_log(file, tmp_path)):
        assert verify_log(path).head == heads[RECORDS]
    assert {path.name for path in tmp_path.iterdir()} == {"log", "log-wal"}


def test_a_log_with_a_view_is_rejected(tmp_path):
    file = make_log(tmp_path / "log", range(3))
    db = sqlite3.connect(file)
    db.executescript("""
        DROP TABLE records;
        CREATE VIEW records AS WITH RECURSIVE endless(i) AS (SELECT 1 UNION ALL SELECT i FROM endless)
        SELECT i AS number, i AS body, i AS digest FROM endless;
    """)
    db.close()
    with pytest.raises(ConfigurationError, match="views or generated columns"):
        verify_log(file)


def test_a_deeply_nested_record_is_shown_as_unreadable(tmp_path, capsys):
    log = EventLogFile(tmp_path / "log")
    log.append([b"[" * 200_000])
    log.close()
    for as_json in (False, True):
        show_events(tmp_path / "log", EventSelection(since=datetime(1, 1, 1)), as_json)
        show_events(tmp_path / "log", EventSelection(), as_json)
    assert "unreadable" in capsys.readouterr().out
    assert verify_log(tmp_path / "log").records == 1


def test_a_truncated_wal_file_loses_only_its_last_records(killed, tmp_path):
    file, heads = killed
    copy, chance = copy_log(file, tmp_path), random.Random(11)
    complete = copy.with_name("log-wal").read_bytes()
    counts = set()
    for size in sorted(chance.sample(range(len(complete)), 40), reverse=True):
        copy.with_name("log-wal").write_bytes(complete[:size])
        try:
            chain = verify_log(copy)
        except (DamagedLogError, BrokenChainError):
            continue  # an error is also correct, because SQLite itself never truncates a -wal file like this
        assert chain.records == 0 or chain.head == heads[chain.records]
        counts.add(chain.records)
    assert len(counts) > 5


@pytest.mark.parametrize("suffix", ["", "-wal"])
@pytest.mark.parametrize("damage", ["truncated", "one bit", "200 bytes"])
def test_a_damaged_log_never_gives_wrong_records(killed, tmp_path, suffix, damage):
    file, heads = killed
    copy, chance = copy_log(file, tmp_path), random.Random(f"{suffix} {damage}")
    part = copy.with_name(f"log{suffix}")
    complete = part.read_bytes()
    results = set()
    for _ in range(30):
        part.write_bytes(damaged(complete, damage, chance))
        try:
            chain = verify_log(copy)
        except (DamagedLogError, BrokenChainError, ConfigurationError) as error:
            results.add(type(error))
            continue
        results.add("unbroken")
        assert chain.records == 0 or chain.head == heads[chain.records]
    assert results


def damaged(data, damage, chance):
    at = chance.randrange(len(data))
    if damage == "truncated":
        return data[:at]
    if damage == "one bit":
        return data[:at] + bytes((data[at] ^ 1 << chance.randrange(8),)) + data[at + 1 :]
    return data[:at] + chance.randbytes(200) + data[at + 200 :]


def test_a_log_with_a_truncated_wal_file_is_continued_or_rejected(killed, tmp_path):
    file, _ = killed
    complete = file.with_name("log-wal").read_bytes()
    continued = 0
    for size in range(len(complete) - 1, 0, -len(complete) // 12):
        folder = tmp_path / str(size)
        folder.mkdir()
        copy = copy_log(file, folder)
        copy.with_name("log-wal").write_bytes(complete[:size])
        try:
            log = EventLogFile(copy)
        except EventLogFileError:
            continue
        log.append([b'{"at":"later"}'])
        log.close()
        try:
            assert verify_log(copy).records >= 1
            continued += 1
        except BrokenChainError:
            continue
    assert continued > 5


def test_the_verification_reports_a_changed_byte(killed, tmp_path):
    file, _ = killed
    copy = copy_log(file, tmp_path)
    copy.with_name("log-wal").write_bytes(b"")
    body = copy.read_bytes()
    at = body.index(b'"at":"5"')
    copy.write_bytes(body[:at] + b'"at":"6"' + body[at + 8 :])
    with pytest.raises(BrokenChainError, match=r"^record 6 "):
        verify_log(copy)


def test_a_damaged_log_names_the_command_that_counts_its_intact_records(tmp_path, capsys):
    file = make_log(tmp_path / "the log", range(300))
    content = bytearray(file.read_bytes())
    content[-8192:-4096] = b"x" * 4096
    file.write_bytes(content)
    with pytest.raises(ConfigurationError) as caught:
        show_events(file, EventSelection(0, None, False), as_json=False)
    command = str(caught.value).partition("; ")[2].partition(" shows")[0]
    assert command == f"pneuforce log verify --file '{file}'"
    shown = capsys.readouterr().out.splitlines()
    intact = count_intact(file, capsys)
    assert 200 < intact < 300
    assert len(shown) == intact + 1  # and the headings


def count_intact(file, capsys):
    """Return the number of intact records that `log verify` states for a damaged log."""
    assert verify_events(file, Verification(), as_json=False) == 1
    return int(re.search(r"intact before the damage: (\d+) records", capsys.readouterr().out)[1])


@pytest.mark.parametrize("cut_bytes", [4096, 4000, 16_384, 20_000])
def test_the_records_before_the_cut_of_a_log_are_verified_and_shown(tmp_path, capsys, cut_bytes):
    file = make_log(tmp_path / "log", range(400))
    file.write_bytes(file.read_bytes()[:-cut_bytes])
    intact = count_intact(file, capsys)
    assert 100 < intact < 400
    with pytest.raises(ConfigurationError, match="cut short"):
        show_events(file, EventSelection(), as_json=True)
    numbers = [json.loads(line)["number"] for line in capsys.readouterr().out.splitlines()]
    assert numbers[:intact] == list(range(1, intact + 1))
    assert numbers == sorted(numbers)


@pytest.mark.parametrize("size", [2000, 8192, 9000])
def test_a_log_that_is_cut_short_is_reported_as_cut_and_not_as_changed(tmp_path, size):
    log = make_log(tmp_path / "log", range(RECORDS))
    complete = log.read_bytes()
    log.write_bytes(complete[:size])
    with pytest.raises(DamagedLogError, match=f"cut short: it has {size} of {len(complete)} bytes"):
        verify_log(log)


def test_an_invalid_structure_is_reported_as_damage_and_the_first_wrong_record_is_named(tmp_path):
    log = make_log(tmp_path / "log", range(RECORDS))
    complete = log.read_bytes()
    log.write_bytes(complete[:-2048] + bytes(2048))
    with pytest.raises(DamagedLogError, match=r"structure is invalid; record \d+ "):
        verify_log(log)


@pytest.mark.parametrize("content", [bytes(4096), random.Random(3).randbytes(4096)], ids=["zeros", "random"])
def test_a_destroyed_page_in_the_middle_is_found_by_the_start_and_by_the_check(tmp_path, content):
    log = make_log(tmp_path / "log", range(400))
    complete = log.read_bytes()
    check_event_log(log)
    log.write_bytes(complete[: 5 * 4096] + content + complete[6 * 4096 :])
    for use in (check_event_log, EventLogFile):
        with pytest.raises(EventLogFileError, match=f"{log} is .*damaged.*: move the file away"):
            use(log)


@pytest.mark.parametrize("size", [9000, 20_000])
def test_the_missing_part_of_a_page_is_not_shown_as_a_record(tmp_path, capsys, size):
    log = make_log(tmp_path / "log", range(400))
    log.write_bytes(log.read_bytes()[:size])
    with pytest.raises(ConfigurationError, match="cut short"):
        show_events(log, EventSelection(), as_json=True)
    assert all(json.loads(line)["number"] > 0 for line in capsys.readouterr().out.splitlines())


@needs("sqlite3")
def test_the_commands_of_the_document_save_the_records_before_and_after_the_damage(tmp_path):
    text = (ROOT / "docs/events.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"```sh\n(\(sqlite3 .*?saved.sqlite)\n", text, re.DOTALL)
    content = make_log(tmp_path / "events.sqlite", range(400)).read_bytes()
    (tmp_path / "events.sqlite").write_bytes(content[: 5 * 4096] + bytes(4096) + content[6 * 4096 :])
    subprocess.run(["sh", "-c", block], cwd=tmp_path, check=True, timeout=60)
    with closing(sqlite3.connect(tmp_path / "saved.sqlite")) as db:
        numbers = [number for (number,) in db.execute("SELECT number FROM records ORDER BY number")]
    assert (numbers[0], numbers[-1], 300 < len(numbers) < 400) == (1, 400, True)
    with pytest.raises(BrokenChainError, match="is missing"):
        verify_log(tmp_path / "saved.sqlite")


def test_a_failed_read_is_repeated_only_if_the_log_was_written_at_the_same_time(tmp_path):
    log, reads = make_log(tmp_path / "log", range(3)), []

    def read(is_written):
        reads.append(1)
        if len(reads) > 1:
            return "good"
        if is_written:
            (tmp_path / "log-wal").write_bytes(b"the first record of a new start")
        raise BrokenChainError("pages of two states")

    with pytest.raises(BrokenChainError):
        repeated_if_changed(log, partial(read, False))
    assert len(reads) == 1
    reads.clear()
    assert repeated_if_changed(log, partial(read, True)) == "good"
