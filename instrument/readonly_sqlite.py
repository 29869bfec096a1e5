"""SQLite's files opened for reading: neither the file nor what lies beside it is changed."""

from __future__ import annotations

import os
import sqlite3
from pathlib import Path
from urllib.parse import quote

from instrument.errors import ConfigurationError

#: Views, and columns that are reckoned at each reading, some without end. It is asked of what SQLite has made
#: of the file: what sqlite_master calls a table may be a view.
_RECKONED = """
    SELECT 1 FROM pragma_table_list AS t, pragma_table_xinfo(t.name) AS c
    WHERE t.type != 'table' OR c.hidden
"""


def connection(path: Path) -> sqlite3.Connection:
    """A file, also while it is written, after a kill, or copied without its index.

    Without a write-ahead log nobody writes. With one and its index somebody writes or was killed, and both
    are there already. With one and no index these are copies: nobody else has to be kept out, and the index
    is made in memory. One that lies beside an empty file is another file's, and SQLite would delete it.

    Raises ConfigurationError: no file that you may read; sqlite3.Error.
    """
    if path.is_dir():
        raise ConfigurationError(f"{path} is a folder: name a file")
    if not path.is_file() or not os.access(path, os.R_OK):
        raise ConfigurationError(f"{path}: no such file, or not to be read by you")
    ahead = Path(f"{path}-wal")
    if not (path.stat().st_size and ahead.is_file() and ahead.stat().st_size):
        return _connected(path, "immutable=1")
    if Path(f"{path}-shm").exists():
        return _connected(path, "mode=ro")
    db = _connected(path, "mode=ro&vfs=unix-none")
    db.execute("PRAGMA locking_mode = EXCLUSIVE")  # which keeps the index in memory
    return db


def _connected(path: Path, how: str) -> sqlite3.Connection:
    uri = f"file:{quote(os.fsencode(path.absolute()))}?{how}"
    return sqlite3.connect(uri, uri=True, isolation_level=None)


def refuse_reckoned(db: sqlite3.Connection, path: Path) -> None:
    """Raises ConfigurationError where reading the file would run what somebody else has put into it."""
    if db.execute(_RECKONED).fetchone():
        raise ConfigurationError(f"{path} holds more than plain tables of rows, so it is not read")
