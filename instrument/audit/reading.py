"""Reader of an event log. An instrument may write the log at the same time."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from pneuforce.instrument.audit.store import check_file_type
from pneuforce.instrument.audit.verification import StoredRecord
from pneuforce.support.readonly_sqlite import open_readonly, reject_generated_columns

#: Lowest row number that SQLite allows. A manipulated file can contain record numbers below 1.
LOWEST = -(2**63)


class DamagedLogError(Exception):
    """Damaged event log. SQLite cannot read the file any further."""


class NotAnEventLogError(DamagedLogError):
    """File that is not an event log, or whose beginning is destroyed. SQLite cannot read it."""


@contextmanager
def open_event_log(path: Path, first: int = LOWEST) -> Iterator[Iterator[StoredRecord]]:
    """Open an event log and provide its records from number `first` on, in order.

    Raises ConfigurationError if the file is missing or is the database of another program. Raises
    DamagedLogError if SQLite cannot read the file. This error can also occur later, while records are read.
    """
    with converted_errors(path), closing(open_readonly(path)) as db:
        db.text_factory = bytes  # text as bytes, so that text with invalid UTF-8 can be verified
        yield _rows(db, path, first)


def _rows(db: sqlite3.Connection, path: Path, first: int) -> Iterator[StoredRecord]:
    db.execute("BEGIN")  # all queries read the same state, even if an instrument creates the file now
    if check_file_type(db, path):
        reject_generated_columns(db, path)
        query = "SELECT number, body, digest FROM records WHERE number >= ? ORDER BY number"
        for row in db.execute(query, (first,)):
            yield StoredRecord(*row)


@contextmanager
def converted_errors(path: Path) -> Iterator[None]:
    """Convert errors of SQLite to DamagedLogError."""
    try:
        yield
    except sqlite3.Error as error:
        if getattr(error, "sqlite_errorcode", None) == sqlite3.SQLITE_NOTADB:
            raise NotAnEventLogError(f"{path} is not an event log, or its beginning is destroyed") from None
        raise DamagedLogError(f"{path} is damaged and cannot be read further: {error}") from None
