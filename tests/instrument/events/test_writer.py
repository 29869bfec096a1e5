"""The writer: what it is given reaches the disk, and a disk that fails costs no more than it must."""

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

from instrument.events.reading import Damaged, opened
from instrument.events.store import NotOurs, Store
from instrument.events.writer import MOST_WAITING, Writer
from tests.instrument.events.keeping import a_record, chain_of

SOON_S = 20.0


def wait_until(so):
    until_s = time.monotonic() + SOON_S
    while not so():
        assert time.monotonic() < until_s, "what was waited for did not come"
        time.sleep(0.01)


def bodies(path):
    with opened(path) as rows:
        return [json.loads(row.body) for row in rows]


@pytest.fixture
def writer(tmp_path):
    folder = tmp_path / "there"
    folder.mkdir()
    made = Writer(folder / "log")
    yield made
    made.close()


def test_what_is_put_is_on_the_disk_soon_though_nobody_closes(writer):
    for number in range(5):
        writer.put(a_record(number))
    wait_until(lambda: chain_of(writer.path).records == 5)
    assert [body["which"] for body in bodies(writer.path)] == list(range(5))


@pytest.fixture
def closes_unhurried(monkeypatch):
    """A disk that others keep busy is given the time that it takes."""
    monkeypatch.setattr("instrument.events.writer.CLOSE_S", SOON_S)


def test_what_is_put_last_is_on_the_disk_when_it_is_closed(closes_unhurried, tmp_path):
    writer = Writer(tmp_path / "log")
    for number in range(2500):
        writer.put(a_record(number))
    writer.close()
    assert chain_of(tmp_path / "log").records == 2500


def test_what_is_put_after_the_last_look_is_on_the_disk_when_it_is_closed(
    closes_unhurried, tmp_path, monkeypatch
):
    """The moment that is rare by itself: put and closed just behind a look at what waits."""
    look, late = Writer._try, [a_record(0)]

    def look_and_hear_of_the_end(writer):
        look(writer)
        while late:
            writer.put(late.pop())
            writer._end.set()

    monkeypatch.setattr(Writer, "_try", look_and_hear_of_the_end)
    writer = Writer(tmp_path / "log")
    wait_until(lambda: not late)
    writer.close()
    assert chain_of(tmp_path / "log").records == 1


def test_a_folder_that_vanishes_costs_no_record_and_the_new_file_names_the_old_head(writer, caplog):
    writer.put(a_record(0))
    wait_until(lambda: chain_of(writer.path).records == 1)
    head = chain_of(writer.path).head
    shutil.rmtree(writer.path.parent)
    wait_until(lambda: writer.trouble)
    writer.put(a_record(1))
    time.sleep(0.3)
    writer.path.parent.mkdir()
    wait_until(lambda: not writer.trouble)
    changed, kept = bodies(writer.path)
    assert (changed["kind"], changed["head_before"]) == ("file_changed", head)
    assert kept["which"] == 1
    said = [record.getMessage() for record in caplog.records]
    assert len([line for line in said if "measuring goes on" in line]) == 1


def test_a_file_that_was_replaced_is_noticed(writer):
    writer.put(a_record(0))
    wait_until(lambda: chain_of(writer.path).records == 1)
    for path in writer.path.parent.iterdir():
        path.unlink()
    writer.path.touch()
    writer.put(a_record(1))
    wait_until(lambda: chain_of(writer.path).records == 2)
    assert [body["kind"] for body in bodies(writer.path)] == ["file_changed", "test"]


def ten_kept(writer):
    """Committed, and by no checkpoint in the file itself as yet."""
    for number in range(10):
        writer.put(a_record(number))
    wait_until(lambda: chain_of(writer.path).records == 10)
    return writer.path


def test_a_log_that_is_moved_away_while_it_is_written_keeps_what_was_committed(writer):
    file = ten_kept(writer)
    moved = file.rename(file.with_name("2026"))
    wait_until(file.exists)
    writer.put(a_record(10))
    wait_until(lambda: len(bodies(file)) == 2)
    assert [body["which"] for body in bodies(moved)] == list(range(10))
    changed, added = bodies(file)
    assert (changed["kind"], added["which"]) == ("file_changed", 10)
    assert changed["head_before"] == chain_of(moved).head
    assert "log was taken away" in changed["why"]


def test_a_log_moved_to_another_disk_is_complete_once_its_write_ahead_log_has_followed(
    writer, tmp_path, caplog
):
    """Such a move is a copy and a deletion."""
    file = ten_kept(writer)
    shutil.copy(file, tmp_path / "2026")
    file.unlink()
    wait_until(lambda: "log-wal holds records of a log that was moved without it" in writer.trouble)
    time.sleep(1.2)
    assert len([line for line in caplog.messages if "moved without it" in line]) == 1
    file.with_name("log-wal").rename(tmp_path / "2026-wal")
    wait_until(lambda: not writer.trouble)
    assert [body["which"] for body in bodies(tmp_path / "2026")] == list(range(10))
    assert [body["kind"] for body in bodies(file)] == ["file_changed"]


def test_a_copy_in_the_place_of_the_log_lacks_no_record(writer, tmp_path):
    file = ten_kept(writer)
    shutil.copy(file, tmp_path / "copy")
    (tmp_path / "copy").replace(file)
    wait_until(lambda: len(bodies(file)) == 11)
    assert [body["kind"] for body in bodies(file)] == ["test"] * 10 + ["file_changed"]


def test_a_log_that_is_cut_short_while_it_is_written_is_noticed(writer):
    """As by a rotation of logs that copies a file and empties it: here all lies beside it still."""
    file = ten_kept(writer)
    time.sleep(0.3)
    os.truncate(file, 0)
    wait_until(lambda: bodies(file)[-1:] and bodies(file)[-1]["kind"] == "file_changed")
    assert bodies(file)[-1]["why"] == "log was cut short"
    assert chain_of(file).records == 11


def test_a_log_that_is_moved_just_before_the_end_keeps_what_was_committed(tmp_path):
    store = Store(tmp_path / "log")
    store.append([b"{}"])
    moved = (tmp_path / "log").rename(tmp_path / "2026")
    store.close()
    assert chain_of(moved).records == 1


def so_many(file):
    """Records; None where it is read just while its writer opens it anew, which cannot be read on."""
    with suppress(Damaged):
        return len(bodies(file))


@pytest.mark.parametrize("beside", ["-wal", "-shm"])
def test_what_lies_beside_the_log_may_be_deleted_and_a_kill_costs_no_record_all_the_same(writer, beside):
    file = ten_kept(writer)
    file.with_name(f"log{beside}").unlink()
    wait_until(lambda: so_many(file) == 11)
    writer.put(a_record(10))
    wait_until(lambda: so_many(file) == 12)
    as_after_a_kill = shutil.copytree(file.parent, file.parent.with_name("killed"))
    *first, changed, last = bodies(as_after_a_kill / "log")
    assert [body["which"] for body in [*first, last]] == list(range(11))
    assert (changed["kind"], changed["why"].partition(",")[0]) == (
        "file_changed",
        f"log{beside} was taken away",
    )


def test_what_waits_is_bounded_and_what_is_lost_is_counted(writer):
    shutil.rmtree(writer.path.parent)
    wait_until(lambda: writer.trouble)
    minor = [a_record(number)._replace(minor=True) for number in range(MOST_WAITING)]
    for record in minor:
        writer.put(record)
    for number in range(MOST_WAITING):
        writer.put(a_record(number))
    writer.path.parent.mkdir()
    wait_until(lambda: not writer.trouble)
    writer.put(a_record(-1))
    wait_until(lambda: bodies(writer.path)[-1]["which"] == -1)
    kept = bodies(writer.path)
    of_kind = {kind: [body for body in kept if body["kind"] == kind] for kind in ("lost", "test")}
    assert len(kept) <= MOST_WAITING + 4
    assert sum(body["times"] for body in of_kind["lost"]) + len(of_kind["test"]) == 2 * MOST_WAITING + 1


def test_a_commit_that_failed_and_was_carried_out_after_all_is_not_written_twice(writer, monkeypatch):
    append = Store.append

    def carried_out_and_failed(store, bodies):
        monkeypatch.setattr(Store, "append", append)
        append(store, bodies)
        raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr(Store, "append", carried_out_and_failed)
    writer.put(a_record(0))
    wait_until(lambda: writer.trouble)
    writer.put(a_record(1))
    wait_until(lambda: not writer.trouble)
    assert [body["which"] for body in bodies(writer.path)] == [0, 1]


def test_a_folder_that_is_not_there_is_no_reason_not_to_start(tmp_path):
    writer = Writer(tmp_path / "nowhere" / "log")
    assert writer.trouble == "No such file or directory"
    writer.put(a_record(0))
    (tmp_path / "nowhere").mkdir()
    wait_until(lambda: not writer.trouble)
    writer.close()
    assert chain_of(tmp_path / "nowhere" / "log").records == 1


def test_a_file_of_others_is_a_reason_not_to_start(tmp_path):
    (tmp_path / "log").write_text("mine")
    with pytest.raises(NotOurs):
        Writer(tmp_path / "log")


FULL = """
import resource, sys, time
from pathlib import Path
from instrument.events.writer import Writer
from tests.instrument.events.keeping import a_record
from tests.instrument.events.test_writer import wait_until
writer, hard = Writer(Path(sys.argv[1])), resource.getrlimit(resource.RLIMIT_FSIZE)[1]
resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, hard))
number = 0
while not writer.trouble:
    writer.put(a_record(number, padding="x" * 500))
    number += 1
    time.sleep(0.001)
print(writer.trouble)
for number in range(number, number + 100):
    writer.put(a_record(number, padding="x" * 500))
time.sleep(1.5)
assert writer.trouble
resource.setrlimit(resource.RLIMIT_FSIZE, (hard, hard))
wait_until(lambda: not writer.trouble)
writer.close()
print(number + 1)
"""


def filled(script, *arguments):
    done = subprocess.run(
        [sys.executable, "-c", script, *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done


@pytest.mark.skipif(not hasattr(resource, "RLIMIT_FSIZE"), reason="no limit to file sizes here")
def test_a_file_that_may_not_grow_loses_nothing_and_is_written_when_it_may(tmp_path):
    done = filled(FULL, tmp_path / "log")
    trouble, count = done.stdout.splitlines()
    assert "disk" in trouble
    assert [body["which"] for body in bodies(tmp_path / "log")] == list(range(int(count)))
    assert done.stderr.count("measuring goes on") == 1


MOVED = """
import resource, sys, time
from pathlib import Path
from instrument.events.writer import Writer
from tests.instrument.events.keeping import a_record, chain_of
from tests.instrument.events.test_writer import wait_until
file = Path(sys.argv[1])
writer, hard = Writer(file), resource.getrlimit(resource.RLIMIT_FSIZE)[1]
for number in range(50):
    writer.put(a_record(number, padding="x" * 500))
wait_until(lambda: chain_of(file).records == 50)
resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, hard))
file.rename(file.with_name("2026"))
wait_until(lambda: "moved without it" in writer.trouble)
file.with_name("log-wal").rename(file.with_name("2026-wal"))
resource.setrlimit(resource.RLIMIT_FSIZE, (hard, hard))
wait_until(lambda: not writer.trouble)
writer.close()
"""


@pytest.mark.skipif(not hasattr(resource, "RLIMIT_FSIZE"), reason="no limit to file sizes here")
def test_a_log_moved_away_on_a_full_disk_throws_nothing_away(tmp_path):
    filled(MOVED, tmp_path / "log")
    assert [body["which"] for body in bodies(tmp_path / "2026")] == list(range(50))


BRIM = """
import sys, time
from pathlib import Path
from instrument.events.writer import Writer
from tests.instrument.events.keeping import a_record
from tests.instrument.events.test_writer import wait_until
folder = Path(sys.argv[1])
def brim():
    with open(folder / "brim", "wb", buffering=0) as file:
        try:
            while True:
                file.write(bytes(4096))
        except OSError:
            pass
brim()
writer, number = Writer(folder / "log"), 0
assert writer.trouble
for again in range(3):
    (folder / "brim").unlink()
    wait_until(lambda: not writer.trouble)
    brim()
    while not writer.trouble:
        writer.put(a_record(number, padding="x" * 500))
        number += 1
        time.sleep(0.001)
(folder / "brim").unlink()
wait_until(lambda: not writer.trouble)
writer.close()
print(number)
"""


@pytest.fixture
def tiny_disk(tmp_path):
    """A file system of 1 MB; only root can have one."""
    folder = tmp_path / "tiny"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(folder)]
    if shutil.which("mount") is None or subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("a small file system cannot be mounted here")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


def test_a_disk_that_fills_again_and_again_costs_no_record(tiny_disk):
    count = int(filled(BRIM, tiny_disk).stdout)
    assert [body["which"] for body in bodies(tiny_disk / "log")] == list(range(count))
