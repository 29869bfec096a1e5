"""Opening of SQLite files for reading. The file and its write-ahead log are not changed."""

from __future__ import annotations

import os
import sqlite3
from pathlib import Path
from urllib.parse import quote

from pneuforce.errors import ConfigurationError
from pneuforce.support.permissions import read_problem

#: Query for views and generated columns. Their expressions run at each reading, and may never end. The query
#: uses the schema as SQLite parsed it, because sqlite_master can declare a view as a table.
_GENERATED_COLUMNS = """
    SELECT 1 FROM pragma_table_list AS t, pragma_table_xinfo(t.name) AS c
    WHERE t.type != 'table' OR c.hidden
"""


def open_readonly(path: Path) -> sqlite3.Connection:
    """Open a SQLite file for reading, even if another program writes it or was killed while writing.

    The mode depends on the write-ahead log (`-wal`) and its index (`-shm`):

    - No log, or an empty log: no process writes, and the file is opened as immutable.
    - Log and index: a process writes the file, or was killed. Reading creates no file.
    - Log without index: the files are copies. No other process uses them, so the index is made in memory.

    An empty file is opened as immutable too. A log next to an empty file belongs to another file, and SQLite
    would delete that log.

    Raises ConfigurationError if `path` is not a readable file, and sqlite3.Error.
    """
    if problem := _problem(path):
        raise ConfigurationError(problem)
    wal = Path(f"{path}-wal")
    if not (path.stat().st_size and wal.is_file() and wal.stat().st_size):
        return _connect(path, "immutable=1")
    if Path(f"{path}-shm").exists():
        return _connect(path, "mode=ro")
    db = _connect(path, "mode=ro&vfs=unix-none")
    db.execute("PRAGMA locking_mode = EXCLUSIVE")  # makes SQLite keep the index in memory
    return db


def _problem(path: Path) -> str:
    """Return why a path is not a readable file, with the remedy; "" if it is readable."""
    try:
        if path.is_dir():
            return f"{path} is a folder: name a file"
        if not path.exists():
            return f"{path}: the file does not exist: check the name and the folder"
        if not path.is_file():
            return f"{path} is not a regular file: name another file"
    except PermissionError:  # of a folder
        pass
    return read_problem(path)


def _connect(path: Path, parameters: str) -> sqlite3.Connection:
    uri = f"file:{quote(os.fsencode(path.absolute()))}?{parameters}"
    return sqlite3.connect(uri, uri=True, isolation_level=None)


def reject_generated_columns(db: sqlite3.Connection, path: Path) -> None:
    """Raise ConfigurationError if a view or a generated column would run expressions from the file."""
    if db.execute(_GENERATED_COLUMNS).fetchone():
        raise ConfigurationError(f"{path} contains views or generated columns, so it is not read")
