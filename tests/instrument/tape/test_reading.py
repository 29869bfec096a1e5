"""Recordings as they are found: cut short, altered, copied by halves, and files that are none."""

import math
import random
import re
import shutil
import sqlite3
import tracemalloc
from contextlib import suppress
from pathlib import Path

import pytest

from instrument.errors import ConfigurationError
from instrument.events.store import Store
from instrument.tape.entry import Kind, told
from instrument.tape.measured import Measured
from instrument.tape.opening import opened
from instrument.tape.schema import checksum, sample_checksum
from tests.instrument.tape.taping import BEGIN_S, DT_S, begun, ended, entries, found, put, same, wanted

COUNT = 800
WANTED = wanted(COUNT)
SAMPLES = same(WANTED.samples)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A recording in good order."""
    return ended(tmp_path_factory.mktemp("whole") / "a.tape", COUNT)


@pytest.fixture(scope="module")
def killed(tmp_path_factory):
    """What a killed recorder leaves: half in the file, the newest beside it."""
    folder = tmp_path_factory.mktemp("killed")
    file = begun(folder / "a.tape")
    put(file, entries(COUNT // 2))
    file._db.execute("PRAGMA wal_checkpoint(PASSIVE)")
    put(file, entries(COUNT - COUNT // 2, first=COUNT // 2 + 1))
    shutil.copytree(folder, folder / "copy")
    file.close()
    return folder / "copy" / "a.tape"


def nothing_wrong_is_read(path):
    """The samples that are read, all of them right; None where the file is refused in a sentence."""
    try:
        read = found(path)
    except ConfigurationError:
        return None
    assert same(read.samples) == SAMPLES[: len(read.samples)]
    assert read.inputs == WANTED.inputs[: len(read.inputs)]
    assert read.events == WANTED.events[: len(read.events)]
    if len(read.samples) < COUNT:
        assert read.remark != ""
    return len(read.samples)


def copied(path, folder, only=("", "-wal", "-shm")):
    for end in only:
        if Path(f"{path}{end}").exists():
            shutil.copyfile(f"{path}{end}", f"{folder / path.name}{end}")
    return folder / path.name


def test_a_file_cut_at_any_byte_gives_what_is_whole_or_a_sentence(whole, tmp_path):
    content = whole.read_bytes()
    cut, read = tmp_path / "cut.tape", set()
    lengths = random.Random(1).sample(range(len(content)), 100)
    for length in [*range(0, len(content), 4096), *lengths]:
        cut.write_bytes(content[:length])
        read.add(nothing_wrong_is_read(cut))
    assert None in read
    assert len(read) > 10  # much of it is salvaged, not all or nothing


@pytest.mark.parametrize("index", [True, False], ids=["as it lies", "copied without its index"])
def test_what_lies_beside_it_cut_at_any_byte_gives_what_is_whole(killed, tmp_path, index):
    path = copied(killed, tmp_path)
    ahead = Path(f"{path}-wal")
    content = ahead.read_bytes()
    read = set()
    for length in random.Random(2).sample(range(len(content)), 40):
        ahead.write_bytes(content[:length])
        copied(killed, tmp_path, only=("-shm",)) if index else Path(f"{path}-shm").unlink(missing_ok=True)
        read.add(nothing_wrong_is_read(path))
    assert None not in read
    assert min(read) >= COUNT // 2
    assert len(read) > 3


@pytest.mark.parametrize("seed", range(2))
def test_no_altered_byte_becomes_a_number(whole, tmp_path, seed):
    content, at = whole.read_bytes(), random.Random(seed)
    altered = tmp_path / "altered.tape"
    for _ in range(60):
        wrong = bytearray(content)
        for _ in range(at.choice((1, 1, 8, 200))):
            wrong[at.randrange(len(wrong))] ^= 1 << at.randrange(8)
        altered.write_bytes(wrong)
        nothing_wrong_is_read(altered)


def test_pages_in_each_others_place_do_not_become_numbers(whole, tmp_path):
    content, at = whole.read_bytes(), random.Random(4)
    swapped, pages = tmp_path / "swapped.tape", len(content) // 4096
    for _ in range(60):
        one, other = (4096 * at.randrange(1, pages) for _ in range(2))
        wrong = bytearray(content)
        wrong[one : one + 4096], wrong[other : other + 4096] = (
            content[other : other + 4096],
            content[one : one + 4096],
        )
        swapped.write_bytes(wrong)
        nothing_wrong_is_read(swapped)


def test_it_says_how_much_of_a_damaged_recording_is_whole(whole, tmp_path):
    altered = tmp_path / "altered.tape"
    shutil.copyfile(whole, altered)
    db = sqlite3.connect(altered)
    db.execute("UPDATE samples SET force_n = 9.9 WHERE number = 601")
    db.commit()
    db.close()
    read = found(altered)
    assert len(read.samples) == 600
    assert "600 rows of samples, up to 1.2 s, are whole (row 601 is not as it was written)" in read.remark


def test_a_sample_that_was_taken_out_is_missed(whole, tmp_path):
    altered = tmp_path / "altered.tape"
    shutil.copyfile(whole, altered)
    db = sqlite3.connect(altered)
    db.execute("DELETE FROM samples WHERE number = 700")
    db.commit()
    db.close()
    assert len(found(altered).samples) == 699


def test_a_killed_recorder_leaves_all_that_was_committed(killed, tmp_path):
    read = found(copied(killed, tmp_path))
    assert same(read.samples) == SAMPLES
    assert (
        f"no end (it is still written, or its recorder was killed): 1.6 s, {COUNT} samples are whole"
        in read.remark
    )


def test_a_copy_without_what_lay_beside_it_has_the_older_part(killed, tmp_path):
    assert nothing_wrong_is_read(copied(killed, tmp_path, only=("",))) == COUNT // 2


@pytest.mark.parametrize("only", [("",), ("", "-wal"), ("", "-wal", "-shm")])
def test_reading_changes_nothing_and_leaves_nothing(killed, tmp_path, only):
    path = copied(killed, tmp_path, only)
    before = {file.name: file.read_bytes() for file in tmp_path.iterdir() if not file.name.endswith("-shm")}
    names = {file.name for file in tmp_path.iterdir()}
    found(path)
    assert {file.name for file in tmp_path.iterdir()} == names
    assert {name: (tmp_path / name).read_bytes() for name in before} == before


def test_a_span_of_time_is_found_without_reading_what_is_before(whole):
    with opened(whole) as recording:
        part = [round((sample.t_s - BEGIN_S) / DT_S) for sample in recording.samples(1.0, 1.1)]
    assert part == list(range(500, 551))


def test_a_span_may_begin_with_the_recording(whole):
    with opened(whole) as recording:
        assert same(recording.samples(0.0, 0.1)) == SAMPLES[:50]
        assert recording.damage == ""


def test_a_span_of_a_recording_whose_end_is_destroyed_has_nothing_from_before_it(whole, tmp_path):
    cut, content = tmp_path / "cut.tape", whole.read_bytes()
    lengths = []
    for length in range(0, len(content), 4096):
        cut.write_bytes(content[:length])
        with suppress(ConfigurationError), opened(cut) as recording:
            if recording.most_samples is None:
                samples = list(recording.samples(0.4))
                assert all(sample.t_s >= BEGIN_S + 0.4 for sample in samples)
                lengths.append(len(samples))
    assert max(lengths) > 100


def test_sqlite_looks_at_each_cell_of_a_page_before_it_believes_one(whole):
    with opened(whole) as recording:
        assert recording._db.execute("PRAGMA cell_size_check").fetchone() == (1,)


def test_a_long_recording_is_never_in_memory_at_once(tmp_path):
    path = ended(tmp_path / "long.tape", 8_000)
    with opened(path) as recording:
        tracemalloc.start()
        assert sum(1 for _ in recording.samples()) == 8_000
        _, most = tracemalloc.get_traced_memory()
        tracemalloc.stop()
    assert most < 4_000_000  # all of them would be 10 MB


def said_of(path):
    try:
        return found(path).remark
    except ConfigurationError as refused:
        return str(refused)


@pytest.mark.parametrize(
    ("table", "columns", "row"),
    [
        ("about", "key = 'begin_s', value", ("begin_s", "[]")),
        ("about", "key = 'begin_s', value", ("begin_s", "{")),
        *(
            ("about", "key = 'begin_s', value", ("begin_s", value))
            for value in ("[" * 200_000, "NaN", "1e999", "-1e308", "1e308")
        ),
        ("events", "t_s = 1.0, utc = '', body", (1.0, "", "{")),
        ("events", "t_s = 1.0, utc = '', body", (1.0, "", "5")),
        ("events", "t_s = 1.0, utc = '', body", (1.0, "", "[" * 200_000)),
        ("tape", "first_t_s = 1.0, entries", (1.0, b"no entries at all")),
        ("tape", "first_t_s = 1.0, entries", (1.0, 5)),
        ("ending", "t_s = 1.0, how = '', why = '', samples", (1.0, "", "", "many")),
    ],
    ids=lambda value: str(value)[:40],
)
def test_what_somebody_put_in_with_its_checksum_right_does_no_harm(whole, tmp_path, table, columns, row):
    forged = tmp_path / "forged.tape"
    shutil.copyfile(whole, forged)
    db = sqlite3.connect(forged)
    db.execute(
        f"UPDATE {table} SET {columns} = ?, crc32 = ? WHERE number = 1", (row[-1], checksum((1, *row)))
    )
    db.commit()
    db.close()
    assert re.search("is damaged|(holds|is) no recording", said_of(forged))


def test_a_sample_without_a_time_ends_what_is_read(whole, tmp_path):
    forged = tmp_path / "forged.tape"
    shutil.copyfile(whole, forged)
    db = sqlite3.connect(forged)
    row = list(db.execute("SELECT * FROM samples WHERE number = 800").fetchone()[:-1])
    row[1 + Measured._fields.index("t_s")] = math.inf
    db.execute("UPDATE samples SET t_s = ?, crc32 = ? WHERE number = 800", (math.inf, sample_checksum(row)))
    db.commit()
    db.close()
    read = found(forged)
    assert len(read.samples) == 799
    assert "sample 800 has no time" in read.remark


ENDLESS = """
    CREATE VIEW checkpoint AS WITH RECURSIVE endless(i) AS (SELECT 1 UNION ALL SELECT i FROM endless)
    SELECT i AS number, i AS t_s, i AS state, i AS crc32 FROM endless
"""
LIE = "PRAGMA writable_schema = ON; UPDATE sqlite_master SET type = 'table' WHERE name = 'checkpoint'"
RUNS = {
    "an endless view": ENDLESS,
    "an endless view that is called a table": f"{ENDLESS}; {LIE}",
    "a column that is reckoned": "CREATE TABLE checkpoint (number, t_s AS (hex(zeroblob(4e8))), crc32)",
    "a view beside the tables": "CREATE VIEW another AS SELECT 1; CREATE TABLE checkpoint (number)",
}


@pytest.mark.parametrize("what", RUNS)
def test_a_file_that_would_run_something_when_it_is_read_is_refused(whole, tmp_path, what):
    forged = tmp_path / "forged.tape"
    shutil.copyfile(whole, forged)
    db = sqlite3.connect(forged)
    db.executescript(f"DROP TABLE checkpoint; {RUNS[what]}")
    db.close()
    with pytest.raises(ConfigurationError, match="more than plain tables of rows"), opened(forged):
        pass


def none_of_ours(path, kind):
    match kind:
        case "folder":
            path.mkdir()
        case "empty":
            path.touch()
        case "text":
            path.write_text("t_s,force_n\n" * 500)
        case "event log":
            Store(path).close()
        case "database":
            db = sqlite3.connect(path)
            db.execute("CREATE TABLE samples (number INTEGER PRIMARY KEY)")
            db.close()
        case "later version":
            ended(path, 5)
            db = sqlite3.connect(path)
            db.execute("PRAGMA user_version = 2")
            db.close()
        case "only a beginning":
            db = sqlite3.connect(path)
            db.execute("PRAGMA user_version = 0")
            db.execute("CREATE TABLE t (x)")
            db.execute("DROP TABLE t")
            db.close()


KINDS = {
    "missing": "no such file",
    "folder": "is a folder",
    "empty": "is empty",
    "text": "is no recording",
    "event log": "another program's database",
    "database": "another program's database",
    "later version": "a recording of version 2",
    "only a beginning": "holds no recording",
}


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_no_recording_is_refused_in_a_sentence_and_left_as_it_is(tmp_path, kind):
    path = tmp_path / "x.tape"
    none_of_ours(path, kind)
    before = path.read_bytes() if path.is_file() else None
    with pytest.raises(ConfigurationError, match=KINDS[kind]), opened(path):
        pass
    assert (path.read_bytes() if path.is_file() else None) == before


@pytest.mark.parametrize(
    ("board", "is_simulated"), [("simulated, serial 1", True), ("real, serial 1", False), (None, False)]
)
def test_a_board_that_greets_after_the_beginning_tells_whether_the_rig_is_real(tmp_path, board, is_simulated):
    file = begun(tmp_path / "a.tape")
    if board:
        facts = {"at": "", "kind": "board", "was": None, "is": board}
        file.put(told(Kind.EVENT, BEGIN_S + 1, facts))
        file.commit()
    file.close()
    with opened(tmp_path / "a.tape") as recording:
        assert recording.simulated == is_simulated
