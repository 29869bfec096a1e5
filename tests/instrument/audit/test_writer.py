"""Tests of the event log writer: all records are written to the disk, and few are lost if the disk fails."""

import errno
import json
import os
import resource
import shutil
import subprocess
import sys
import time
from contextlib import suppress

import pytest

from pneuforce.instrument.audit.reading import DamagedLogError, open_event_log
from pneuforce.instrument.audit.store import EventLogFile, EventLogFileError
from pneuforce.instrument.audit.writer import MAX_WAITING, EventLogWriter
from pneuforce.instrument.core.event_log_head import EventLogHead
from tests.instrument.audit.event_log_files import make_record, verify_log

TIMEOUT_S = 20.0


def wait_until(condition):
    until_s = time.monotonic() + TIMEOUT_S
    while not condition():
        assert time.monotonic() < until_s, "the condition was not reached in time"
        time.sleep(0.01)


def bodies(path):
    with open_event_log(path) as rows:
        return [json.loads(row.body) for row in rows]


@pytest.fixture
def writer(tmp_path):
    folder = tmp_path / "there"
    folder.mkdir()
    made = EventLogWriter(folder / "log")
    yield made
    made.close()


def test_the_head_is_that_of_the_records_on_the_disk(writer):
    assert writer.head == EventLogHead()
    for count in (1, 2):
        writer.append(make_record(count))
        wait_until(lambda count=count: writer.head.records == count)
        assert writer.head.digest.hex() == verify_log(writer.path).head
    digits = "".join(f"{writer.head.digest_word(index):08x}" for index in (0, 1))
    assert verify_log(writer.path).head.startswith(digits)


def test_the_head_of_an_existing_log_is_known_at_the_start(writer):
    writer.append(make_record(1))
    writer.close()
    again = EventLogWriter(writer.path)
    assert again.head == writer.head
    assert again.head.records == 1
    again.close()


def test_records_are_written_soon_without_a_close(writer):
    for number in range(5):
        writer.append(make_record(number))
    wait_until(lambda: verify_log(writer.path).records == 5)
    assert [body["which"] for body in bodies(writer.path)] == list(range(5))


@pytest.fixture
def long_close_timeout(monkeypatch):
    """Increase the time limit of `close`, because the disk may be busy during the tests."""
    monkeypatch.setattr("pneuforce.instrument.audit.writer.CLOSE_S", TIMEOUT_S)


def test_close_writes_all_waiting_records(long_close_timeout, tmp_path):
    writer = EventLogWriter(tmp_path / "log")
    for number in range(2500):
        writer.append(make_record(number))
    writer.close()
    assert verify_log(tmp_path / "log").records == 2500


def test_close_writes_a_record_appended_just_before(long_close_timeout, tmp_path, monkeypatch):
    """The record is appended, and the writer is closed, right after the thread has written its batch."""
    original, late = EventLogWriter._try, [make_record(0)]

    def write_then_append_and_end(writer):
        original(writer)
        while late:
            writer.append(late.pop())
            writer._end.set()

    monkeypatch.setattr(EventLogWriter, "_try", write_then_append_and_end)
    writer = EventLogWriter(tmp_path / "log")
    wait_until(lambda: not late)
    writer.close()
    assert verify_log(tmp_path / "log").records == 1


def test_a_removed_folder_loses_no_record_and_the_new_file_has_the_old_head(writer, caplog):
    writer.append(make_record(0))
    wait_until(lambda: verify_log(writer.path).records == 1)
    head = verify_log(writer.path).head
    shutil.rmtree(writer.path.parent)
    wait_until(lambda: writer.write_error)
    writer.append(make_record(1))
    time.sleep(0.3)
    writer.path.parent.mkdir()
    wait_until(lambda: not writer.write_error)
    changed, added = bodies(writer.path)
    assert (changed["kind"], changed["head_before"]) == ("file_changed", head)
    assert added["which"] == 1
    assert len([line for line in caplog.messages if "cannot be written" in line]) == 1


def test_a_replaced_file_is_detected(writer):
    writer.append(make_record(0))
    wait_until(lambda: verify_log(writer.path).records == 1)
    for path in writer.path.parent.iterdir():
        path.unlink()
    writer.path.touch()
    writer.append(make_record(1))
    wait_until(lambda: verify_log(writer.path).records == 2)
    assert [body["kind"] for body in bodies(writer.path)] == ["file_changed", "test"]


def write_ten_records(writer):
    """Append ten records and wait until they are committed. They are still in the -wal file."""
    for number in range(10):
        writer.append(make_record(number))
    wait_until(lambda: verify_log(writer.path).records == 10)
    return writer.path


def test_a_log_moved_while_it_is_written_keeps_the_committed_records(writer):
    file = write_ten_records(writer)
    moved = file.rename(file.with_name("2026"))
    wait_until(file.exists)
    writer.append(make_record(10))
    wait_until(lambda: len(bodies(file)) == 2)
    assert [body["which"] for body in bodies(moved)] == list(range(10))
    changed, added = bodies(file)
    assert (changed["kind"], added["which"]) == ("file_changed", 10)
    assert changed["head_before"] == verify_log(moved).head
    assert "log was removed" in changed["why"]


def test_a_log_moved_to_another_disk_is_complete_with_its_wal_file(writer, tmp_path, caplog):
    """The test copies and then deletes the file, because a move to another disk does the same."""
    file = write_ten_records(writer)
    shutil.copy(file, tmp_path / "2026")
    file.unlink()
    wait_until(
        lambda: "log-wal contains records of an event log that was moved without" in writer.write_error
    )
    time.sleep(1.2)
    assert len([line for line in caplog.messages if "moved without" in line]) == 1
    file.with_name("log-wal").rename(tmp_path / "2026-wal")
    wait_until(lambda: not writer.write_error)
    assert [body["which"] for body in bodies(tmp_path / "2026")] == list(range(10))
    assert [body["kind"] for body in bodies(file)] == ["file_changed"]


def test_a_copy_that_replaces_the_log_has_all_records(writer, tmp_path):
    file = write_ten_records(writer)
    shutil.copy(file, tmp_path / "copy")
    (tmp_path / "copy").replace(file)
    wait_until(lambda: len(bodies(file)) == 11)
    assert [body["kind"] for body in bodies(file)] == ["test"] * 10 + ["file_changed"]


def test_a_truncated_log_is_detected(writer):
    """The option copytruncate of logrotate truncates a log. Here all records are still in the -wal file."""
    file = write_ten_records(writer)
    time.sleep(0.3)
    os.truncate(file, 0)
    wait_until(lambda: bodies(file)[-1:] and bodies(file)[-1]["kind"] == "file_changed")
    assert bodies(file)[-1]["why"] == "log was truncated"
    assert verify_log(file).records == 11


def test_a_log_moved_just_before_close_keeps_the_committed_records(tmp_path):
    log = EventLogFile(tmp_path / "log")
    log.append([b"{}"])
    moved = (tmp_path / "log").rename(tmp_path / "2026")
    log.close()
    assert verify_log(moved).records == 1


def record_count(file):
    """Return the number of records, or None while the writer opens the file again."""
    with suppress(DamagedLogError):
        return len(bodies(file))


@pytest.mark.parametrize("suffix", ["-wal", "-shm"])
def test_a_deleted_side_file_and_a_kill_lose_no_record(writer, suffix):
    file = write_ten_records(writer)
    file.with_name(f"log{suffix}").unlink()
    wait_until(lambda: record_count(file) == 11)
    writer.append(make_record(10))
    wait_until(lambda: record_count(file) == 12)
    killed = shutil.copytree(file.parent, file.parent.with_name("killed"))
    *first, changed, last = bodies(killed / "log")
    assert [body["which"] for body in [*first, last]] == list(range(11))
    assert changed["kind"] == "file_changed"
    assert changed["why"].startswith(f"log{suffix} was removed")


def test_the_waiting_records_are_limited_and_lost_records_are_counted(writer):
    shutil.rmtree(writer.path.parent)
    wait_until(lambda: writer.write_error)
    minor = [make_record(number)._replace(minor=True) for number in range(MAX_WAITING)]
    for record in minor:
        writer.append(record)
    for number in range(MAX_WAITING):
        writer.append(make_record(number))
    writer.path.parent.mkdir()
    wait_until(lambda: not writer.write_error)
    writer.append(make_record(-1))
    wait_until(lambda: bodies(writer.path)[-1]["which"] == -1)
    written = bodies(writer.path)
    of_kind = {kind: [body for body in written if body["kind"] == kind] for kind in ("lost", "test")}
    assert len(written) <= MAX_WAITING + 4
    assert sum(body["times"] for body in of_kind["lost"]) + len(of_kind["test"]) == 2 * MAX_WAITING + 1


def test_a_commit_that_succeeded_despite_an_error_is_not_repeated(writer, monkeypatch):
    append = EventLogFile.append

    def append_then_fail(log, bodies):
        monkeypatch.setattr(EventLogFile, "append", append)
        append(log, bodies)
        raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr(EventLogFile, "append", append_then_fail)
    writer.append(make_record(0))
    wait_until(lambda: writer.write_error)
    writer.append(make_record(1))
    wait_until(lambda: not writer.write_error)
    assert [body["which"] for body in bodies(writer.path)] == [0, 1]


def test_the_writer_starts_without_the_folder_of_the_log(tmp_path):
    writer = EventLogWriter(tmp_path / "nowhere" / "log")
    assert writer.write_error == "No such file or directory"
    writer.append(make_record(0))
    (tmp_path / "nowhere").mkdir()
    wait_until(lambda: not writer.write_error)
    writer.close()
    assert verify_log(tmp_path / "nowhere" / "log").records == 1


def test_the_writer_does_not_start_with_another_file(tmp_path):
    (tmp_path / "log").write_text("notes")
    with pytest.raises(EventLogFileError):
        EventLogWriter(tmp_path / "log")


FULL = """
import resource, sys, time
from pathlib import Path
from pneuforce.instrument.audit.writer import EventLogWriter
from tests.instrument.audit.event_log_files import make_record
from tests.instrument.audit.test_writer import wait_until
writer, hard = EventLogWriter(Path(sys.argv[1])), resource.getrlimit(resource.RLIMIT_FSIZE)[1]
resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, hard))
number = 0
while not writer.write_error:
    writer.append(make_record(number, padding="x" * 500))
    number += 1
    time.sleep(0.001)
print(writer.write_error)
for number in range(number, number + 100):
    writer.append(make_record(number, padding="x" * 500))
time.sleep(1.5)
assert writer.write_error
resource.setrlimit(resource.RLIMIT_FSIZE, (hard, hard))
wait_until(lambda: not writer.write_error)
writer.close()
print(number + 1)
"""


def run_script(script, *arguments):
    done = subprocess.run(
        [sys.executable, "-c", script, *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done


@pytest.mark.skipif(not hasattr(resource, "RLIMIT_FSIZE"), reason="this system cannot limit file sizes")
def test_a_file_at_its_size_limit_loses_no_record(tmp_path):
    done = run_script(FULL, tmp_path / "log")
    write_error, count = done.stdout.splitlines()
    assert "disk" in write_error
    assert [body["which"] for body in bodies(tmp_path / "log")] == list(range(int(count)))
    assert done.stderr.count("cannot be written") == 1


MOVED = """
import resource, sys, time
from pathlib import Path
from pneuforce.instrument.audit.writer import EventLogWriter
from tests.instrument.audit.event_log_files import make_record, verify_log
from tests.instrument.audit.test_writer import wait_until
file = Path(sys.argv[1])
writer, hard = EventLogWriter(file), resource.getrlimit(resource.RLIMIT_FSIZE)[1]
for number in range(50):
    writer.append(make_record(number, padding="x" * 500))
wait_until(lambda: verify_log(file).records == 50)
resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, hard))
file.rename(file.with_name("2026"))
wait_until(lambda: "moved without" in writer.write_error)
file.with_name("log-wal").rename(file.with_name("2026-wal"))
resource.setrlimit(resource.RLIMIT_FSIZE, (hard, hard))
wait_until(lambda: not writer.write_error)
writer.close()
"""


@pytest.mark.skipif(not hasattr(resource, "RLIMIT_FSIZE"), reason="this system cannot limit file sizes")
def test_a_log_moved_on_a_full_disk_loses_no_record(tmp_path):
    run_script(MOVED, tmp_path / "log")
    assert [body["which"] for body in bodies(tmp_path / "2026")] == list(range(50))


FILLED_REPEATEDLY = """
import sys, time
from pathlib import Path
from pneuforce.instrument.audit.writer import EventLogWriter
from tests.instrument.audit.event_log_files import make_record
from tests.instrument.audit.test_writer import wait_until
folder = Path(sys.argv[1])
def fill_disk():
    with open(folder / "filler", "wb", buffering=0) as file:
        try:
            while True:
                file.write(bytes(4096))
        except OSError:
            pass
fill_disk()
writer, number = EventLogWriter(folder / "log"), 0
assert writer.write_error
for again in range(3):
    (folder / "filler").unlink()
    wait_until(lambda: not writer.write_error)
    fill_disk()
    while not writer.write_error:
        writer.append(make_record(number, padding="x" * 500))
        number += 1
        time.sleep(0.001)
(folder / "filler").unlink()
wait_until(lambda: not writer.write_error)
writer.close()
print(number)
"""


@pytest.fixture
def tiny_disk(tmp_path):
    """Mount a file system of 1 MB. The test is skipped if the user may not mount."""
    folder = tmp_path / "tiny"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(folder)]
    if shutil.which("mount") is None or subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("a small file system cannot be mounted here")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


def test_a_disk_that_fills_repeatedly_loses_no_record(tiny_disk):
    count = int(run_script(FILLED_REPEATEDLY, tiny_disk).stdout)
    assert [body["which"] for body in bodies(tiny_disk / "log")] == list(range(count))
