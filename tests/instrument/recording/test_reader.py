"""Tests of reading damaged and incomplete recordings, and files that are not recordings."""

import random
import shutil
import sqlite3
import tracemalloc
from contextlib import suppress
from pathlib import Path

import pytest

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.audit.store import EventLogFile
from pneuforce.instrument.recording.opening import open_recording
from pneuforce.instrument.stream.entry import EntryKind, json_entry
from tests.instrument.recording.recording_files import (
    BEGIN_S,
    DT_S,
    add_entries,
    begin_recording,
    comparable,
    expected_contents,
    make_entries,
    make_recording,
    read_contents,
)

COUNT = 800
EXPECTED = expected_contents(COUNT)
SAMPLES = comparable(EXPECTED.samples)


@pytest.fixture(scope="module")
def intact(tmp_path_factory):
    """Return an intact recording."""
    return make_recording(tmp_path_factory.mktemp("intact") / "a.recording", COUNT)


@pytest.fixture(scope="module")
def killed(tmp_path_factory):
    """Return the recording of a killed recorder.

    The main file contains the older half of the samples, the -wal file the newer half.
    """
    folder = tmp_path_factory.mktemp("killed")
    file = begin_recording(folder / "a.recording")
    add_entries(file, make_entries(COUNT // 2))
    file._db.execute("PRAGMA wal_checkpoint(PASSIVE)")
    add_entries(file, make_entries(COUNT - COUNT // 2, first=COUNT // 2 + 1))
    shutil.copytree(folder, folder / "copy")
    file.close()
    return folder / "copy" / "a.recording"


def read_correct_samples(path):
    """Check all samples that can be read. Return their number, or None if the file is rejected."""
    try:
        contents = read_contents(path)
    except ConfigurationError:
        return None
    assert comparable(contents.samples) == SAMPLES[: len(contents.samples)]
    assert contents.inputs == EXPECTED.inputs[: len(contents.inputs)]
    assert contents.events == EXPECTED.events[: len(contents.events)]
    if len(contents.samples) < COUNT:
        assert contents.remark != ""
    return len(contents.samples)


def copy_files(path, folder, suffixes=("", "-wal", "-shm")):
    for suffix in suffixes:
        if Path(f"{path}{suffix}").exists():
            shutil.copyfile(f"{path}{suffix}", f"{folder / path.name}{suffix}")
    return folder / path.name


def test_a_file_truncated_at_any_byte_gives_correct_samples_or_is_rejected(intact, tmp_path):
    content = intact.read_bytes()
    cut, counts = tmp_path / "cut.recording", set()
    lengths = random.Random(1).sample(range(len(content)), 100)
    for length in [*range(0, len(content), 4096), *lengths]:
        cut.write_bytes(content[:length])
        counts.add(read_correct_samples(cut))
    assert None in counts
    assert len(counts) > 10  # samples of truncated files are recovered


@pytest.mark.parametrize("index", [True, False], ids=["with index", "without index"])
def test_a_wal_file_truncated_at_any_byte_gives_correct_samples(killed, tmp_path, index):
    path = copy_files(killed, tmp_path)
    wal = Path(f"{path}-wal")
    content = wal.read_bytes()
    counts = set()
    for length in random.Random(2).sample(range(len(content)), 40):
        wal.write_bytes(content[:length])
        copy_files(killed, tmp_path, suffixes=("-shm",)) if index else Path(f"{path}-shm").unlink(
            missing_ok=True
        )
        counts.add(read_correct_samples(path))
    assert None not in counts
    assert min(counts) >= COUNT // 2
    assert len(counts) > 3


@pytest.mark.parametrize("seed", range(2))
def test_changed_bytes_give_no_wrong_number(intact, tmp_path, seed):
    content, chance = intact.read_bytes(), random.Random(seed)
    altered = tmp_path / "altered.recording"
    for _ in range(60):
        wrong = bytearray(content)
        for _ in range(chance.choice((1, 1, 8, 200))):
            wrong[chance.randrange(len(wrong))] ^= 1 << chance.randrange(8)
        altered.write_bytes(wrong)
        read_correct_samples(altered)


def test_exchanged_pages_give_no_wrong_number(intact, tmp_path):
    content, chance = intact.read_bytes(), random.Random(4)
    swapped, pages = tmp_path / "swapped.recording", len(content) // 4096
    for _ in range(60):
        one, other = (4096 * chance.randrange(1, pages) for _ in range(2))
        wrong = bytearray(content)
        wrong[one : one + 4096], wrong[other : other + 4096] = (
            content[other : other + 4096],
            content[one : one + 4096],
        )
        swapped.write_bytes(wrong)
        read_correct_samples(swapped)


def test_the_remark_on_a_damaged_recording_says_how_much_is_intact(intact, tmp_path):
    altered = tmp_path / "altered.recording"
    shutil.copyfile(intact, altered)
    db = sqlite3.connect(altered)
    db.execute("UPDATE samples SET force_n = 9.9 WHERE number = 601")
    db.commit()
    db.close()
    contents = read_contents(altered)
    assert len(contents.samples) == 600
    assert "600 rows of samples, up to 1.2 s, are intact (row 601 " in contents.remark


def test_the_remark_on_samples_and_events_that_are_damaged_is_about_the_samples(intact, tmp_path):
    altered = tmp_path / "altered.recording"
    shutil.copyfile(intact, altered)
    db = sqlite3.connect(altered)
    db.execute("UPDATE events SET t_s = 0 WHERE number = 1")
    db.execute("UPDATE samples SET force_n = 9.9 WHERE number = 601")
    db.commit()
    db.close()
    with open_recording(altered) as recording:
        assert list(recording.events()) == []
        assert "no row of events is intact" in recording.remark()
        assert len(list(recording.samples())) == 600
        assert list(recording.events()) == []
        assert "600 rows of samples" in recording.remark()


def test_a_removed_sample_is_detected(intact, tmp_path):
    altered = tmp_path / "altered.recording"
    shutil.copyfile(intact, altered)
    db = sqlite3.connect(altered)
    db.execute("DELETE FROM samples WHERE number = 700")
    db.commit()
    db.close()
    assert len(read_contents(altered).samples) == 699


def test_a_killed_recorder_leaves_all_committed_samples(killed, tmp_path):
    contents = read_contents(copy_files(killed, tmp_path))
    assert comparable(contents.samples) == SAMPLES
    assert (
        "no end (it is still written, the disk was full, or its recorder was killed): 1.6 s, "
        f"{COUNT} samples are intact" in contents.remark
    )


def test_a_copy_without_the_wal_file_has_the_older_part(killed, tmp_path):
    assert read_correct_samples(copy_files(killed, tmp_path, suffixes=("",))) == COUNT // 2


@pytest.mark.parametrize("suffixes", [("",), ("", "-wal"), ("", "-wal", "-shm")])
def test_reading_changes_no_file_and_creates_none(killed, tmp_path, suffixes):
    path = copy_files(killed, tmp_path, suffixes)
    before = {file.name: file.read_bytes() for file in tmp_path.iterdir() if not file.name.endswith("-shm")}
    names = {file.name for file in tmp_path.iterdir()}
    read_contents(path)
    assert {file.name for file in tmp_path.iterdir()} == names
    assert {name: (tmp_path / name).read_bytes() for name in before} == before


def test_samples_of_a_time_span_are_read(intact):
    with open_recording(intact) as recording:
        part = [round((sample.t_s - BEGIN_S) / DT_S) for sample in recording.samples(1.0, 1.1)]
    assert part == list(range(500, 551))


def test_a_time_span_can_begin_at_zero(intact):
    with open_recording(intact) as recording:
        assert comparable(recording.samples(0.0, 0.1)) == SAMPLES[:50]
        assert recording.damage == ""


def test_a_time_span_of_a_truncated_recording_has_no_earlier_samples(intact, tmp_path):
    cut, content = tmp_path / "cut.recording", intact.read_bytes()
    lengths = []
    for length in range(0, len(content), 4096):
        cut.write_bytes(content[:length])
        with suppress(ConfigurationError), open_recording(cut) as recording:
            if recording.sample_count is None:
                samples = list(recording.samples(0.4))
                assert all(sample.t_s >= BEGIN_S + 0.4 for sample in samples)
                lengths.append(len(samples))
    assert max(lengths) > 100


def test_sqlite_checks_the_cell_sizes_of_each_page(intact):
    with open_recording(intact) as recording:
        assert recording._db.execute("PRAGMA cell_size_check").fetchone() == (1,)


def test_a_long_recording_is_read_in_parts(tmp_path):
    path = make_recording(tmp_path / "long.recording", 8_000)
    with open_recording(path) as recording:
        tracemalloc.start()
        assert sum(1 for _ in recording.samples()) == 8_000
        _, peak_bytes = tracemalloc.get_traced_memory()
        tracemalloc.stop()
    assert peak_bytes < 4_000_000  # all samples together need 10 MB


def make_other_file(path, kind):
    match kind:
        case "folder":
            path.mkdir()
        case "empty":
            path.touch()
        case "text":
            path.write_text("t_s,force_n\n" * 500)
        case "event log":
            EventLogFile(path).close()
        case "database":
            db = sqlite3.connect(path)
            db.execute("CREATE TABLE samples (number INTEGER PRIMARY KEY)")
            db.close()
        case "earlier version" | "later version":
            make_recording(path, 5)
            db = sqlite3.connect(path)
            db.execute(f"PRAGMA user_version = {1 if kind == 'earlier version' else 3}")
            db.close()
        case "no tables":
            db = sqlite3.connect(path)
            db.execute("PRAGMA user_version = 0")
            db.execute("CREATE TABLE t (x)")
            db.execute("DROP TABLE t")
            db.close()


KINDS = {
    "missing": "does not exist",
    "folder": "is a folder",
    "empty": "is empty",
    "text": "is not a recording",
    "event log": "database of another program",
    "database": "database of another program",
    "earlier version": "format version 1",
    "later version": "format version 3",
    "no tables": "contains no recording",
}


@pytest.mark.parametrize("kind", KINDS)
def test_a_file_that_is_not_a_recording_is_rejected_and_not_changed(tmp_path, kind):
    path = tmp_path / "x.recording"
    make_other_file(path, kind)
    before = path.read_bytes() if path.is_file() else None
    with pytest.raises(ConfigurationError, match=KINDS[kind]), open_recording(path):
        pass
    assert (path.read_bytes() if path.is_file() else None) == before


@pytest.mark.parametrize(
    ("board", "is_simulated"), [("simulated, serial 1", True), ("real, serial 1", False), (None, False)]
)
def test_a_board_that_connects_later_decides_whether_the_rig_is_simulated(tmp_path, board, is_simulated):
    file = begin_recording(tmp_path / "a.recording")
    if board:
        facts = {"at": "", "kind": "board", "was": None, "is": board}
        file.add_entry(json_entry(EntryKind.EVENT, BEGIN_S + 1, facts))
        file.commit()
    file.close()
    with open_recording(tmp_path / "a.recording") as recording:
        assert recording.simulated == is_simulated


def test_a_recording_without_samples_and_without_an_end_is_described_without_a_number(tmp_path):
    begin_recording(tmp_path / "a.recording").close()
    with open_recording(tmp_path / "a.recording") as recording:
        assert recording.remark().endswith("it contains no sample")


def test_a_last_sample_that_cannot_be_read_has_no_duration(intact, tmp_path):
    altered = tmp_path / "altered.recording"
    shutil.copyfile(intact, altered)
    db = sqlite3.connect(altered)
    db.execute("DELETE FROM ending")
    db.execute("UPDATE samples SET t_s = NULL WHERE number = ?", (COUNT,))
    db.commit()
    db.close()
    with open_recording(altered) as recording:
        assert f"the last of {COUNT} samples cannot be read" in recording.remark()
