"""File format of a recording: SQLite tables in which each row has a checksum.

SQLite detects missing pages, but not changed bytes. A row is therefore used only if its checksum is correct.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping, Sequence
from enum import StrEnum
from typing import Any, get_type_hints
from zlib import crc32

from pneuforce.instrument.stream.sample_record import SampleRecord

APPLICATION = 0x504E4574  #: application id in the header of the file, which identifies a recording
VERSION = 2  #: version of the format; the checkpoint of version 1 was a pickle

SAMPLE_COLUMNS = SampleRecord._fields
#: Columns of each table without the row number and the checksum.
TABLES = {
    "about": ("key", "value"),  #: fields of the HEADER entry; each value is JSON
    "checkpoint": ("t_s", "state"),
    "inputs": ("first_t_s", "entries"),  #: encoded input entries, in batches
    "samples": SAMPLE_COLUMNS,  #: NULL if a quantity is not available
    "events": ("t_s", "utc", "body"),
    "ending": ("t_s", "how", "why", "samples"),  #: `samples` is the number of recorded samples
}


STOP_REQUESTED = "stop requested"  #: value of `why` if a user stopped the instrument


class EndReason(StrEnum):
    """Reason why a recording ended. A recorder that was killed or could not write leaves no reason."""

    END = "the instrument ended"
    STOPPED = "the recorder was stopped"
    CUT_OFF = "the connection was cut off"
    UNWRITABLE = "the file cannot be written"


#: Python type of each field of a sample.
SAMPLE_TYPES: Mapping[str, type] = get_type_hints(SampleRecord)
_SAMPLE_DEFINITION = ", ".join(
    f"{name} {'REAL' if kind is float else 'INTEGER'}" for name, kind in SAMPLE_TYPES.items()
)
_DOUBLE = struct.Struct("<d")
_SAMPLE_ROW = struct.Struct(f"<{1 + len(SAMPLE_COLUMNS)}d")

CREATE_TABLES = f"""
    BEGIN IMMEDIATE;
    PRAGMA application_id = {APPLICATION};
    PRAGMA user_version = {VERSION};
    CREATE TABLE about (number INTEGER PRIMARY KEY, key TEXT, value TEXT, crc32 INTEGER);
    CREATE TABLE checkpoint (number INTEGER PRIMARY KEY, t_s REAL, state BLOB, crc32 INTEGER);
    CREATE TABLE inputs (number INTEGER PRIMARY KEY, first_t_s REAL, entries BLOB, crc32 INTEGER);
    CREATE TABLE samples (number INTEGER PRIMARY KEY, {_SAMPLE_DEFINITION}, crc32 INTEGER);
    CREATE TABLE events (number INTEGER PRIMARY KEY, t_s REAL, utc TEXT, body TEXT, crc32 INTEGER);
    CREATE TABLE ending
        (number INTEGER PRIMARY KEY, t_s REAL, how TEXT, why TEXT, samples INTEGER, crc32 INTEGER);
    COMMIT;
"""


def insert_into(table: str) -> str:
    """Return the SQL statement that inserts a row with its number and its checksum."""
    return f"INSERT INTO {table} VALUES ({', '.join('?' * (len(TABLES[table]) + 2))})"


def select_from(table: str) -> str:
    """Return the SQL statement that selects rows with number and checksum.

    The parameters of the statement are the first row number and the maximum number of rows.
    """
    columns = ", ".join(("number", *TABLES[table], "crc32"))
    return f"SELECT {columns} FROM {table} WHERE number >= ? ORDER BY number LIMIT ?"


def checksum(row: Sequence[Any]) -> int:
    """Return the CRC-32 of a row, including the row number.

    Numbers are encoded as little-endian doubles, NULL as NaN, and text as UTF-8. Raises TypeError,
    struct.error or UnicodeError if the row contains a value that a recording does not have.
    """
    return crc32(b"".join(map(_bytes_of, row)))


def sample_checksum(row: Sequence[float | None]) -> int:
    """Return the same value as `checksum`, for a row that contains only numbers and NULL.

    This function is faster than `checksum`, which matters at 500 samples per second.
    """
    return crc32(_SAMPLE_ROW.pack(*[math.nan if value is None else value + 0.0 for value in row]))


def _bytes_of(value: Any) -> bytes:
    if isinstance(value, str):
        return value.encode()
    if isinstance(value, bytes):
        return value
    # The sum removes the sign of a zero, because SQLite does not store this sign.
    return _DOUBLE.pack(math.nan if value is None else value + 0.0)
