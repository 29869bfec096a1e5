"""Reading a log, also while an instrument writes it."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from instrument.events.store import check_identity
from instrument.events.verification import Row
from instrument.readonly_sqlite import connection, refuse_reckoned

LOWEST = -(2**63)  #: of SQLite's numbers: who looks for what was altered must not overlook one below 1


class Damaged(Exception):
    """A file that SQLite cannot read on."""


class NoLog(Damaged):
    """A file of which SQLite can read nothing."""


@contextmanager
def opened(path: Path, first: int = LOWEST) -> Iterator[Iterator[Row]]:
    """The records of a log from number `first` on, in order, as they lie in the file.

    Raises ConfigurationError: no such file, no event log; Damaged, also while the rows are read.
    """
    with _damage_in_words(path), closing(connection(path)) as db:
        db.text_factory = bytes  # a damaged text is still to be judged
        yield _rows(db, path, first)


def _rows(db: sqlite3.Connection, path: Path, first: int) -> Iterator[Row]:
    db.execute("BEGIN")  # all as it was at one moment, also where it is just being made
    if check_identity(db, path):
        refuse_reckoned(db, path)
        wanted = "SELECT number, body, seal FROM records WHERE number >= ? ORDER BY number"
        for row in db.execute(wanted, (first,)):
            yield Row(*row)


@contextmanager
def _damage_in_words(path: Path) -> Iterator[None]:
    try:
        yield
    except sqlite3.Error as error:
        if getattr(error, "sqlite_errorcode", None) == sqlite3.SQLITE_NOTADB:
            raise NoLog(f"{path} is not an event log, or its beginning is destroyed") from None
        raise Damaged(f"{path} cannot be read on: {error}") from None
