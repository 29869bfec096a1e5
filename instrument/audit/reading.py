"""Reading of an event log, also while an instrument writes it."""

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
    """Damage at which SQLite cannot continue to read the file."""


class NotAnEventLogError(DamagedLogError):
    """File of which SQLite cannot read anything."""


@contextmanager
def open_event_log(path: Path, first: int = LOWEST) -> Iterator[Iterator[StoredRecord]]:
    """Open an event log and provide its records from number `first` on, in order.

    Raises ConfigurationError if the file is missing or is not an event log. Raises DamagedLogError, also
    while the records are read.
    """
    with _converted_errors(path), closing(open_readonly(path)) as db:
        db.text_factory = bytes  # damaged text can still be verified
        yield _rows(db, path, first)


def _rows(db: sqlite3.Connection, path: Path, first: int) -> Iterator[StoredRecord]:
    db.execute("BEGIN")  # one consistent state, also while the file is created
    if check_file_type(db, path):
        reject_generated_columns(db, path)
        query = "SELECT number, body, digest FROM records WHERE number >= ? ORDER BY number"
        for row in db.execute(query, (first,)):
            yield StoredRecord(*row)


@contextmanager
def _converted_errors(path: Path) -> Iterator[None]:
    """Convert errors of SQLite to DamagedLogError."""
    try:
        yield
    except sqlite3.Error as error:
        if getattr(error, "sqlite_errorcode", None) == sqlite3.SQLITE_NOTADB:
            raise NotAnEventLogError(f"{path} is not an event log, or its beginning is destroyed") from None
        raise DamagedLogError(f"{path} is damaged and cannot be read further: {error}") from None
