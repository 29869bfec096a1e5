"""Opening a recording to read it, if it is one of this program's."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from instrument.errors import ConfigurationError
from instrument.readonly_sqlite import connection, refuse_reckoned
from instrument.tape.reading import MISSING, Recording
from instrument.tape.schema import APPLICATION, VERSION


@contextmanager
def opened(path: Path) -> Iterator[Recording]:
    """A recording. Raises ConfigurationError: no such file, none of ours, or nothing of it can be read."""
    try:
        db = connection(path)
    except sqlite3.Error as error:
        raise ConfigurationError(f"{path} cannot be opened: {error}") from None
    with closing(db):
        try:
            _prepare(db, path)
            recording = Recording(path, db)
        except sqlite3.DatabaseError as error:
            raise ConfigurationError(
                f"{path} is no recording, or its beginning is destroyed ({error})"
            ) from None
        yield recording


def _prepare(db: sqlite3.Connection, path: Path) -> None:
    if not path.stat().st_size:
        raise ConfigurationError(f"{path} is empty, no recording")
    db.execute("PRAGMA writable_schema = ON")  # which lets SQLite read a file that was cut short
    db.execute("PRAGMA cell_size_check = ON")
    (application,) = db.execute("PRAGMA application_id").fetchone()
    (version,) = db.execute("PRAGMA user_version").fetchone()
    if application == 0 and not db.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]:
        raise ConfigurationError(f"{path} holds no recording ({MISSING})")
    if application != APPLICATION:
        raise ConfigurationError(f"{path} is another program's database, no recording")
    if version != VERSION:
        raise ConfigurationError(f"{path} is a recording of version {version}, this program reads {VERSION}")
    refuse_reckoned(db, path)
