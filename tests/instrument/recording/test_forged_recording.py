"""Tests of reading forged recordings, in which all checksums are correct."""

import math
import re
import shutil
import sqlite3

import pytest

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.recording.opening import open_recording
from pneuforce.instrument.recording.schema import checksum, sample_checksum
from pneuforce.instrument.stream.entry import EntryKind, StreamEntry, encode
from pneuforce.instrument.stream.sample_record import SampleRecord
from tests.instrument.recording.recording_files import make_recording, read_contents


@pytest.fixture(scope="module")
def intact(tmp_path_factory):
    return make_recording(tmp_path_factory.mktemp("intact") / "a.recording", 1000)


@pytest.fixture
def forged(intact, tmp_path):
    """Return a copy of an intact recording, which the test changes."""
    return shutil.copyfile(intact, tmp_path / "forged.recording")


def remark_or_error(path):
    try:
        return read_contents(path).remark
    except ConfigurationError as error:
        return str(error)


@pytest.mark.parametrize(
    ("table", "columns", "row"),
    [
        ("about", "key = 'begin_s', value", ("begin_s", "[]")),
        ("about", "key = 'begin_s', value", ("begin_s", "{")),
        *(
            ("about", "key = 'begin_s', value", ("begin_s", value))
            for value in ("[" * 200_000, "NaN", "1e999", "-1e308", "1e308", "9" * 4000)
        ),
        ("events", "t_s = 1.0, utc = '', body", (1.0, "", "{")),
        ("events", "t_s = 1.0, utc = '', body", (1.0, "", "5")),
        ("events", "t_s = 1.0, utc = '', body", (1.0, "", "[" * 200_000)),
        ("events", "t_s = 1.0, utc = '', body", (1.0, "", '{"is": ' + "[" * 30 + "]" * 30 + "}")),
        ("inputs", "first_t_s = 1.0, entries", (1.0, b"no entries at all")),
        ("inputs", "first_t_s = 1.0, entries", (1.0, encode(StreamEntry(EntryKind.TICK, math.nan)))),
        ("inputs", "first_t_s = 1.0, entries", (1.0, encode(StreamEntry(EntryKind.TICK, 1e300)))),
        ("inputs", "first_t_s = 1.0, entries", (1.0, 5)),
        ("ending", "t_s = 1.0, how = '', why = '', samples", (1.0, "", "", "many")),
    ],
    ids=lambda value: str(value)[:40],
)
def test_forged_rows_with_a_correct_checksum_are_reported(forged, table, columns, row):
    db = sqlite3.connect(forged)
    db.execute(
        f"UPDATE {table} SET {columns} = ?, crc32 = ? WHERE number = 1", (row[-1], checksum((1, *row)))
    )
    db.commit()
    db.close()
    assert re.search("is damaged|contains no recording|is not a recording", remark_or_error(forged))


@pytest.mark.parametrize(
    ("column", "value"),
    [
        ("t_s", math.inf),
        ("t_s", None),
        ("state", 4.5),
        ("state", None),
        ("state", 1e300),
        ("adc_sum", -1),
        ("adc_sum", 65_536),
        ("board_time_us", 2**62),
        ("in_contact", 2),
        ("in_contact", None),
        ("quality", math.inf),
    ],
)
def test_a_sample_with_an_invalid_value_ends_the_reading(forged, column, value):
    db = sqlite3.connect(forged)
    row = list(db.execute("SELECT * FROM samples WHERE number = 800").fetchone()[:-1])
    row[1 + SampleRecord._fields.index(column)] = value
    db.execute(
        f"UPDATE samples SET {column} = ?, crc32 = ? WHERE number = 800", (value, sample_checksum(row))
    )
    db.commit()
    db.close()
    contents = read_contents(forged)
    assert len(contents.samples) == 799
    assert "sample 800 has" in contents.remark


def test_a_text_in_the_file_cannot_control_the_terminal(forged):
    db = sqlite3.connect(forged)
    row = (1, 1.0, "cut\x1b[2J\n", "x" * 100_000, 5)
    db.execute("INSERT OR REPLACE INTO ending VALUES (?, ?, ?, ?, ?, ?)", (*row, checksum(row)))
    db.commit()
    db.close()
    remark = remark_or_error(forged)
    assert remark.isprintable()
    assert len(remark) < 1000


ENDLESS = """
    CREATE VIEW checkpoint AS WITH RECURSIVE endless(i) AS (SELECT 1 UNION ALL SELECT i FROM endless)
    SELECT i AS number, i AS t_s, i AS state, i AS crc32 FROM endless
"""
FALSE_TYPE = "PRAGMA writable_schema = ON; UPDATE sqlite_master SET type = 'table' WHERE name = 'checkpoint'"
FORGED_SCHEMAS = {
    "an endless view": ENDLESS,
    "an endless view declared as a table": f"{ENDLESS}; {FALSE_TYPE}",
    "a generated column": "CREATE TABLE checkpoint (number, t_s AS (hex(zeroblob(4e8))), crc32)",
    "a view beside the tables": "CREATE VIEW another AS SELECT 1; CREATE TABLE checkpoint (number)",
}


@pytest.mark.parametrize("schema", FORGED_SCHEMAS)
def test_a_file_with_views_or_generated_columns_is_rejected(forged, schema):
    db = sqlite3.connect(forged)
    db.executescript(f"DROP TABLE checkpoint; {FORGED_SCHEMAS[schema]}")
    db.close()
    with pytest.raises(ConfigurationError, match="views or generated columns"), open_recording(forged):
        pass


@pytest.mark.parametrize("columns", ["number, t_s, state, crc32", "number INTEGER, t_s, state, crc32"])
def test_a_table_without_row_numbers_is_rejected(forged, columns):
    """The time to read such a table would grow with the square of its length."""
    db = sqlite3.connect(forged)
    db.executescript(f"DROP TABLE checkpoint; CREATE TABLE checkpoint ({columns})")
    db.close()
    with pytest.raises(ConfigurationError, match="checkpoint"), open_recording(forged):
        pass
