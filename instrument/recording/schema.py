"""How a recording lies in its file: tables of SQLite, each row with a checksum of its own.

SQLite notices missing pages, but no altered byte: a row is believed where its checksum agrees.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping, Sequence
from enum import StrEnum
from typing import Any, get_type_hints
from zlib import crc32

from instrument.tape.measured import Measured

APPLICATION = 0x504E4574  #: in the header of the file, so that it is known for what it is
VERSION = 1

SAMPLE = Measured._fields
#: Columns of each table, the number of a row and its checksum left out.
TABLES = {
    "about": ("key", "value"),  #: what BEGIN said; values as JSON
    "checkpoint": ("t_s", "state"),
    "tape": ("first_t_s", "entries"),  #: inputs, as they came from the instrument, in batches
    "samples": SAMPLE,  #: NULL where a quantity is not available
    "events": ("t_s", "utc", "body"),
    "ending": ("t_s", "how", "why", "samples"),  #: how many there are
}


ASKED = "asked to stop"  #: why an instrument ended that was told to


class How(StrEnum):
    """How a recording ended; a file that says nothing of it had its recorder killed, or took no more."""

    END = "the instrument ended"
    STOPPED = "the recorder was stopped"
    CUT_OFF = "the connection was cut off"
    UNWRITABLE = "the file cannot be written"


#: What each field of a sample is in Python.
KINDS: Mapping[str, type] = get_type_hints(Measured)
_SAMPLE_COLUMNS = ", ".join(
    f"{name} {'REAL' if kind is float else 'INTEGER'}" for name, kind in KINDS.items()
)
_DOUBLE = struct.Struct("<d")
_SAMPLE_ROW = struct.Struct(f"<{1 + len(SAMPLE)}d")

CREATE = f"""
    BEGIN IMMEDIATE;
    PRAGMA application_id = {APPLICATION};
    PRAGMA user_version = {VERSION};
    CREATE TABLE about (number INTEGER PRIMARY KEY, key TEXT, value TEXT, crc32 INTEGER);
    CREATE TABLE checkpoint (number INTEGER PRIMARY KEY, t_s REAL, state BLOB, crc32 INTEGER);
    CREATE TABLE tape (number INTEGER PRIMARY KEY, first_t_s REAL, entries BLOB, crc32 INTEGER);
    CREATE TABLE samples (number INTEGER PRIMARY KEY, {_SAMPLE_COLUMNS}, crc32 INTEGER);
    CREATE TABLE events (number INTEGER PRIMARY KEY, t_s REAL, utc TEXT, body TEXT, crc32 INTEGER);
    CREATE TABLE ending
        (number INTEGER PRIMARY KEY, t_s REAL, how TEXT, why TEXT, samples INTEGER, crc32 INTEGER);
    COMMIT;
"""


def insert_into(table: str) -> str:
    """The statement that puts a row with its number and checksum into a table."""
    return f"INSERT INTO {table} VALUES ({', '.join('?' * (len(TABLES[table]) + 2))})"


def select_from(table: str) -> str:
    """The statement that reads so many rows from a number on, each with its number and checksum."""
    columns = ", ".join(("number", *TABLES[table], "crc32"))
    return f"SELECT {columns} FROM {table} WHERE number >= ? ORDER BY number LIMIT ?"


def checksum(row: Sequence[Any]) -> int:
    """CRC-32 over a row and its number: numbers as little-endian doubles, NULL as NaN, texts as UTF-8.

    Raises TypeError, struct.error or UnicodeError for what no row of ours contains.
    """
    return crc32(b"".join(map(_bytes_of, row)))


def sample_checksum(row: Sequence[float | None]) -> int:
    """The same for a row of numbers alone, of which there are 500 a second."""
    return crc32(_SAMPLE_ROW.pack(*[math.nan if value is None else value + 0.0 for value in row]))


def _bytes_of(value: Any) -> bytes:
    if isinstance(value, str):
        return value.encode()
    if isinstance(value, bytes):
        return value
    return _DOUBLE.pack(math.nan if value is None else value + 0.0)  # SQLite keeps no sign of a zero
