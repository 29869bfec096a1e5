"""Opening a recording to read it: neither the file nor what lies beside it is changed."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from urllib.parse import quote

from instrument.errors import ConfigurationError
from instrument.tape.reading import MISSING, Recording
from instrument.tape.schema import APPLICATION, VERSION


@contextmanager
def opened(path: Path) -> Iterator[Recording]:
    """A recording. Raises ConfigurationError: no such file, none of ours, or nothing of it can be read."""
    with closing(sqlite3.connect(_uri(path), uri=True, isolation_level=None)) as db:
        try:
            _prepare(db, path)
            recording = Recording(path, db)
        except sqlite3.DatabaseError as error:
            raise ConfigurationError(
                f"{path} is no recording, or its beginning is destroyed ({error})"
            ) from None
        yield recording


def _prepare(db: sqlite3.Connection, path: Path) -> None:
    db.execute("PRAGMA writable_schema = ON")  # which lets SQLite read a file that was cut short
    db.execute("PRAGMA cell_size_check = ON")
    if _ahead(path) and not _index(path):
        db.execute("PRAGMA locking_mode = EXCLUSIVE")  # keeps the index of what is ahead in memory
    (application,) = db.execute("PRAGMA application_id").fetchone()
    (version,) = db.execute("PRAGMA user_version").fetchone()
    if application == 0 and not db.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]:
        raise ConfigurationError(f"{path} holds no recording ({MISSING})")
    if application != APPLICATION:
        raise ConfigurationError(f"{path} is another program's database, no recording")
    if version != VERSION:
        raise ConfigurationError(f"{path} is a recording of version {version}, this program reads {VERSION}")


def _uri(path: Path) -> str:
    """How to open it so that SQLite leaves no file of its own beside it, and takes none away.

    Without a write-ahead log nobody writes. With one and its index a recorder runs or was killed, and both
    are there already. With one and no index these are copies: nobody else has to be kept out.
    """
    if path.is_dir():
        raise ConfigurationError(f"{path} is a folder: name a recording")
    if not path.is_file() or not os.access(path, os.R_OK):
        raise ConfigurationError(f"{path}: no such file, or not to be read by you")
    if not path.stat().st_size:
        raise ConfigurationError(f"{path} is empty, no recording")
    how = "immutable=1"
    if _ahead(path):
        how = "mode=ro" if _index(path) else "mode=ro&vfs=unix-none"
    return f"file:{quote(os.fsencode(path.absolute()))}?{how}"


def _ahead(path: Path) -> bool:
    file = Path(f"{path}-wal")
    return file.is_file() and file.stat().st_size > 0


def _index(path: Path) -> bool:
    return Path(f"{path}-shm").exists()
