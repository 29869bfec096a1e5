"""Reader of an event log. An instrument may write the log at the same time."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TypeVar

from pneuforce.instrument.audit.store import check_file_type, structure_damage
from pneuforce.instrument.audit.verification import BrokenChainError, StoredRecord
from pneuforce.support.readonly_sqlite import open_readonly, reject_generated_columns

#: Lowest row number that SQLite allows. A manipulated file can contain record numbers below 1.
LOWEST = -(2**63)
HEADER_BYTES = 100  #: header of a SQLite file

Result = TypeVar("Result")


class DamagedLogError(Exception):
    """Damaged event log: it is cut short, its structure is invalid, or SQLite cannot read it any further."""


class NotAnEventLogError(DamagedLogError):
    """File that is not an event log, or whose beginning is destroyed. SQLite cannot read it."""


@contextmanager
def open_event_log(path: Path, first: int = LOWEST) -> Iterator[Iterator[StoredRecord]]:
    """Open an event log and provide its records from number `first` on, in order.

    Raises ConfigurationError if the file is missing or is the database of another program. Raises
    DamagedLogError if SQLite cannot read the file. This error can also occur later, while records are read: a
    file that is cut short first provides the records before the cut. The error replaces the BrokenChainError
    of a caller if the file itself is damaged.
    """
    with converted_errors(path), closing(open_readonly(path)) as db:
        db.text_factory = bytes  # text as bytes, so that text with invalid UTF-8 can be verified
        yield _rows(db, path, first)


def latest_records(path: Path, count: int) -> list[StoredRecord]:
    """Return the latest records of an event log, the oldest of them first, without reading the others.

    Raises ConfigurationError if the file is missing or is the database of another program, and
    DamagedLogError if SQLite cannot read the file.
    """

    def read() -> list[StoredRecord]:
        with converted_errors(path), closing(open_readonly(path)) as db:
            db.text_factory = bytes
            db.execute("BEGIN")
            if not check_file_type(db, path):
                return []
            reject_generated_columns(db, path)
            query = "SELECT number, body, digest FROM records ORDER BY number DESC LIMIT ?"
            return [StoredRecord(*row) for row in reversed(db.execute(query, (count,)).fetchall())]

    return repeated_if_changed(path, read)


def _rows(db: sqlite3.Connection, path: Path, first: int) -> Iterator[StoredRecord]:
    db.execute("BEGIN")  # all queries read the same state, even if an instrument creates the file now
    cut = ""
    try:
        is_log = check_file_type(db, path)
    except sqlite3.DatabaseError:
        if not (cut := _missing_end(path)):
            raise
        db.execute("PRAGMA writable_schema = ON")  # otherwise SQLite reads no page of such a file
        is_log = check_file_type(db, path)
    if is_log:
        reject_generated_columns(db, path)
        query = "SELECT number, body, digest FROM records WHERE number >= ? ORDER BY number"
        previous = first - 1
        for row in db.execute(query, (first,)):
            if isinstance(row[0], int):
                # SQLite reads the missing part of a page as records with the number 0 and without a body.
                if (row[0] <= previous or row[1] is None) and (cut := _missing_end(path)):
                    break
                previous = row[0]
            yield StoredRecord(*row)
    if cut:
        raise DamagedLogError(cut)


@contextmanager
def converted_errors(path: Path) -> Iterator[None]:
    """Convert errors of SQLite, and a broken chain in a damaged file, to DamagedLogError."""
    try:
        yield
    except sqlite3.Error as error:
        if cut := _missing_end(path):
            raise DamagedLogError(cut) from None
        if getattr(error, "sqlite_errorcode", None) == sqlite3.SQLITE_NOTADB:
            raise NotAnEventLogError(f"{path} is not an event log, or its beginning is destroyed") from None
        raise DamagedLogError(f"{path} is damaged and cannot be read further: {error}") from None
    except BrokenChainError as error:
        if damage := _missing_end(path) or _damaged_structure(path):
            raise DamagedLogError(f"{damage}; {error}") from None
        raise


def _missing_end(path: Path) -> str:
    """Return that a file is shorter than its header says, "" if it is complete."""
    with path.open("rb") as file:
        header = file.read(HEADER_BYTES)
    page_bytes, pages = int.from_bytes(header[16:18], "big"), int.from_bytes(header[28:32], "big")
    expected = max(HEADER_BYTES, (65_536 if page_bytes == 1 else page_bytes) * pages)
    size = path.stat().st_size
    if not header.startswith(b"SQLite format 3\0") or size >= expected:
        return ""
    return f"{path} is cut short: it has {size} of {expected} bytes, as after an incomplete copy"


def _damaged_structure(path: Path) -> str:
    """Return that the structure of a file is damaged, "" if it is intact. SQL cannot cause such damage."""
    try:
        with closing(open_readonly(path)) as db:
            reject_generated_columns(db, path)
            damage = structure_damage(db)
    except sqlite3.Error as error:
        damage = str(error)
    return f"{path} is damaged, as after an error of the disk: its structure is invalid" if damage else ""


def repeated_if_changed(path: Path, read: Callable[[], Result]) -> Result:
    """Return the result of `read`. Repeat a failed read once if the log was written at the same time.

    The log of a stopped instrument is opened as immutable, so that reading creates no file. If an instrument
    starts during such a read, SQLite may read pages of two states.
    """
    before = _state(path)
    try:
        return read()
    except (BrokenChainError, DamagedLogError):
        if _state(path) == before:
            raise
    return read()


def _state(path: Path) -> list[tuple[int, int, int]]:
    """Return inode, size and time of the log and of its write-ahead log, if they exist."""
    files = (file.stat() for file in (path, Path(f"{path}-wal")) if file.exists())
    return [(status.st_ino, status.st_size, status.st_mtime_ns) for status in files]
