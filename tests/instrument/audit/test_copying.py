"""Tests of `log copy`: the copy is complete and verified, and the log and its writer are not disturbed."""

import json
import os
import random
import resource
import shutil
import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import pytest

from pneuforce.errors import ConfigurationError, WriteFailed
from pneuforce.instrument.audit.copying import copy_event_log
from pneuforce.instrument.audit.reading import DamagedLogError
from pneuforce.instrument.audit.store import EventLogFile
from pneuforce.instrument.audit.verification import BrokenChainError
from pneuforce.instrument.cli.log.copying import copy_events
from tests.instrument.audit.event_log_files import make_log, verify_log

COPIES = 25
#: Process that appends records, and moves the -wal file into the log again and again, until stdin ends.
WRITE = """
import sys, threading
from pathlib import Path
from pneuforce.instrument.audit.store import EventLogFile
log, ended = EventLogFile(Path(sys.argv[1])), threading.Event()
threading.Thread(target=lambda: (sys.stdin.read(), ended.set()), daemon=True).start()
while not ended.is_set():
    log.append([b'{"at":"%d","padding":"%s"}' % (log.record_count, b"x" * 900)] * 5)
    if log.record_count % 35 == 0:
        log._db.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    if log.record_count == 5:
        print("ready", flush=True)
print(log.record_count, log.head.hex(), flush=True)
log.close()
"""


@pytest.fixture
def file(tmp_path):
    return make_log(tmp_path / "log", range(300))


def content_of(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_each_copy_of_a_growing_log_is_unbroken(tmp_path):
    log, copies = tmp_path / "log", [tmp_path / f"copy {number}" for number in range(COPIES)]
    words = [sys.executable, "-c", WRITE, str(log)]
    with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as writer:
        assert writer.stdout.readline() == "ready\n"
        reported = [copy_event_log(log, copy) for copy in copies]
        output, _ = writer.communicate(timeout=600)
    assert writer.returncode == 0
    records, head = output.split()
    assert (verify_log(log).records, verify_log(log).head) == (int(records), head)
    assert [verify_log(copy) for copy in copies] == reported
    assert all(verify_log(log, chain.head) for chain in reported)
    assert sorted(chain.records for chain in reported) == [chain.records for chain in reported]


def test_a_copy_contains_the_records_that_are_only_in_the_wal_file(tmp_path):
    log = EventLogFile(tmp_path / "log")
    log.append([b'{"at":"1"}', b'{"at":"2"}'])
    (tmp_path / "copies").mkdir()
    copy = tmp_path / "copies/log"
    assert copy_event_log(tmp_path / "log", copy).records == 2
    log.append([b'{"at":"3"}'])
    log.close()
    assert verify_log(copy).records == 2
    assert [path.name for path in copy.parent.iterdir()] == ["log"]


def test_a_copy_is_readable_only_for_its_owner_and_can_be_continued(file, tmp_path):
    copy = tmp_path / "copy"
    mask = os.umask(0)
    try:
        assert copy_events(file, copy, overwrite=False, as_json=False) == 0
    finally:
        os.umask(mask)
    assert copy.stat().st_mode & 0o777 == 0o600
    assert verify_log(make_log(copy, [300])).records == 301


@pytest.mark.parametrize("running", [False, True])
def test_the_log_is_not_changed(file, tmp_path, running):
    writer = EventLogFile(file) if running else None
    if writer:
        writer.append([b'{"at":"1"}'])
    before = content_of(tmp_path)
    copy_event_log(file, tmp_path / "copy")
    after = content_of(tmp_path)
    del after["copy"]
    before.pop("log-shm", None), after.pop("log-shm", None)  # contains the locks of the readers
    assert after == before
    if writer:
        writer.close()


def test_the_result_names_the_records_and_the_head(file, tmp_path, capsys):
    assert copy_events(file, tmp_path / "copy", overwrite=False, as_json=True) == 0
    result = json.loads(capsys.readouterr().out)
    assert (result["ok"], result["file"]) == (True, str(tmp_path / "copy"))
    assert (result["records"], result["head"]) == (300, verify_log(file).head)


def test_an_existing_copy_is_replaced_only_on_request(file, tmp_path):
    copy = make_log(tmp_path / "copy", range(3))
    with pytest.raises(ConfigurationError, match="--overwrite"):
        copy_events(file, copy, overwrite=False, as_json=False)
    assert verify_log(copy).records == 3
    assert copy_events(file, copy, overwrite=True, as_json=False) == 0
    assert verify_log(copy).records == 300


@pytest.mark.parametrize("target", ["log", "log-wal", "link"])
def test_the_log_is_never_replaced_by_its_copy(tmp_path, target):
    log = EventLogFile(tmp_path / "log")
    log.append([b'{"at":"1"}'])
    (tmp_path / "link").symlink_to("log")
    before = content_of(tmp_path)
    with pytest.raises(ConfigurationError, match="file of the log"):
        copy_events(tmp_path / "log", tmp_path / target, overwrite=True, as_json=False)
    assert content_of(tmp_path) == before
    log.close()


def test_a_side_file_of_an_earlier_copy_is_never_read_into_the_copy(file, tmp_path):
    (tmp_path / "copy").touch()
    (tmp_path / "copy-wal").write_bytes(b"of another log")
    with pytest.raises(ConfigurationError, match="copy-wal"):
        copy_events(file, tmp_path / "copy", overwrite=True, as_json=False)


def test_a_changed_log_keeps_the_earlier_copy(file, tmp_path, capsys):
    copy = Path(shutil.copy(file, tmp_path / "copy"))
    with closing(sqlite3.connect(file)) as db:
        db.execute("DROP TRIGGER no_update")
        db.execute("UPDATE records SET body = '{}' WHERE number = 9")
        db.commit()
    with pytest.raises(BrokenChainError, match="record 9"):
        copy_event_log(file, tmp_path / "other")
    assert copy_events(file, copy, overwrite=True, as_json=True) == 1
    assert json.loads(capsys.readouterr().out)["ok"] is False
    assert verify_log(copy).records == 300


def test_a_damaged_log_is_reported(file, tmp_path):
    content = bytearray(file.read_bytes())
    content[4096 * 3 : 4096 * 5] = random.Random(3).randbytes(8192)
    file.write_bytes(content)
    with pytest.raises((DamagedLogError, BrokenChainError)):
        copy_event_log(file, tmp_path / "copy")


def test_a_file_without_records_and_other_databases_are_rejected(tmp_path):
    (tmp_path / "empty").touch()
    with closing(sqlite3.connect(tmp_path / "other")) as db:
        db.execute("CREATE TABLE a (b)")
    for name in ("empty", "other", "missing"):
        with pytest.raises(ConfigurationError, match=name):
            copy_events(tmp_path / name, tmp_path / "copy", overwrite=False, as_json=False)
    assert {path.name for path in tmp_path.iterdir()} == {"empty", "other"}


def test_a_full_disk_leaves_no_file(file, tmp_path):
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, limits[1]))
    try:
        with pytest.raises(WriteFailed):
            copy_events(file, tmp_path / "copy", overwrite=False, as_json=False)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert {path.name for path in tmp_path.iterdir()} == {"log"}


def test_a_copy_in_a_missing_folder_names_the_folder(file, tmp_path):
    with pytest.raises(ConfigurationError, match=r"create the folder .*missing"):
        copy_events(file, tmp_path / "missing" / "copy", overwrite=False, as_json=False)
