"""The file of the log: a SQLite table that only grows, written by one process at a time."""

from __future__ import annotations

import errno
import fcntl
import os
import sqlite3
import stat
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from instrument.errors import ConfigurationError
from instrument.events.record import GENESIS, seal

APPLICATION = 0x504E4576  #: in the header of the file, so that it is known for what it is
VERSION = 1
LOCK_WAIT_S = 1.0
CLOSE_WAIT_MS = 200  #: for who reads meanwhile; the end of an instrument waits no longer

_SCHEMA = f"""
    BEGIN IMMEDIATE;
    PRAGMA application_id = {APPLICATION};
    PRAGMA user_version = {VERSION};
    CREATE TABLE records (number INTEGER PRIMARY KEY, body TEXT NOT NULL, seal BLOB NOT NULL);
    CREATE TRIGGER no_update BEFORE UPDATE ON records BEGIN SELECT RAISE(ABORT, 'append only'); END;
    CREATE TRIGGER no_delete BEFORE DELETE ON records BEGIN SELECT RAISE(ABORT, 'append only'); END;
    COMMIT;
"""

_NO_DATABASE = {sqlite3.SQLITE_NOTADB, sqlite3.SQLITE_CORRUPT}


class NotOurs(ConfigurationError):
    """A file that is no event log of this version, or that another instrument writes."""


class Store:
    """The file, open for appending.

    Everything raises OSError or sqlite3.Error where the disk does not let it; opening raises NotOurs.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._size = 0  #: as it was last seen
        ahead = Path(f"{path}-wal")
        _refuse_leftovers(path, ahead)
        # A lock of its own, for SQLite's are not held between transactions. The descriptor must outlive
        # SQLite's: closing any descriptor of a file drops all POSIX locks that the process has on it.
        self._lock = _locked(path)
        try:
            self._open()
            self._ours = {file: _identity(file) for file in (ahead, Path(f"{path}-shm"))}
        except sqlite3.DatabaseError as error:
            os.close(self._lock)
            if getattr(error, "sqlite_errorcode", 0) & 0xFF in _NO_DATABASE:
                raise NotOurs(f"{path} is no event log, or a damaged one: move it away ({error})") from None
            raise
        except BaseException:
            os.close(self._lock)
            raise

    def _open(self) -> None:
        self._db = sqlite3.connect(
            self._path, isolation_level=None, check_same_thread=False, timeout=LOCK_WAIT_S
        )
        try:
            self._identify()
            self._at = self._newest()
        except BaseException:
            self._db.close()
            raise

    def _newest(self) -> tuple[int, bytes]:
        newest = "SELECT number, seal FROM records ORDER BY number DESC LIMIT 1"
        number, head = self._db.execute(newest).fetchone() or (0, GENESIS)
        if not isinstance(head, bytes) or len(head) != len(GENESIS):
            raise NotOurs(f"{self._path} is a damaged event log: move it away (record {number} has no seal)")
        return number, head

    def _identify(self) -> None:
        for pragma in ("journal_size_limit = 8000000", "synchronous = FULL"):
            self._db.execute(f"PRAGMA {pragma}")
        own = check_identity(self._db, self._path)
        (mode,) = self._db.execute("PRAGMA journal_mode = WAL").fetchone()
        if mode != "wal":
            raise OSError(errno.ENOTSUP, "SQLite's write-ahead log does not work on this file system")
        if not own:
            self._db.executescript(_SCHEMA)

    @property
    def head(self) -> bytes:
        """Seal of the last record."""
        return self._at[1]

    def append(self, bodies: Sequence[bytes]) -> None:
        """Append records, all or none; when this returns they are on the disk."""
        rows = self.sealed(bodies)
        self._db.execute("BEGIN IMMEDIATE")
        try:
            self._db.executemany("INSERT INTO records VALUES (?, ?, ?)", rows)
            self._db.execute("COMMIT")
        except BaseException:
            with suppress(sqlite3.Error):
                self._db.execute("ROLLBACK")
            raise
        self._at = rows[-1][0], rows[-1][2]

    def sealed(self, bodies: Sequence[bytes]) -> list[tuple[int, str, bytes]]:
        """The rows that these bodies become when they are appended."""
        rows, (last, head) = [], self._at
        for number, body in enumerate(bodies, last + 1):
            head = seal(head, body)
            rows.append((number, body.decode(), head))
        return rows

    def check_in_place(self) -> None:
        """Raises OSError where an open file is not the one with that name any more, or was cut short."""
        named = os.fstat(self._lock)
        if named.st_size < self._size:
            raise OSError(errno.ESTALE, f"{self._path.name} was cut short")
        self._size = named.st_size
        for file, ours in {self._path: (named.st_dev, named.st_ino), **self._ours}.items():
            if _identity(file) != ours:
                raise OSError(errno.ESTALE, f"{file.name} was taken away, or another put in its place")

    def close(self) -> None:
        """Give the file back, complete: SQLite leaves a moved one without its write-ahead log.

        That of a deleted one stays: it belongs to the copy, if it was copied and not just deleted.
        """
        if os.fstat(self._lock).st_nlink:
            self._empty_write_ahead_log()
        with suppress(sqlite3.Error):
            self._db.close()
        os.close(self._lock)

    def _empty_write_ahead_log(self) -> None:
        with suppress(sqlite3.Error):
            self._db.execute(f"PRAGMA busy_timeout = {CLOSE_WAIT_MS}")
            self._db.execute("PRAGMA wal_checkpoint(TRUNCATE)")


def _refuse_leftovers(path: Path, ahead: Path) -> None:
    """SQLite throws away what lies beside an empty file, whoever opens that: none is begun there."""
    if ahead.is_file() and ahead.stat().st_size and not (path.exists() and path.stat().st_size):
        raise NotOurs(
            f"{ahead} holds records of a log that was moved without it: move it to that log, "
            "named as the log and -wal, or delete it"
        )


def _identity(file: Path) -> tuple[int, int] | None:
    """What tells a file from another that has taken its name; None where there is none."""
    try:
        found = file.stat()
    except FileNotFoundError:
        return None
    return found.st_dev, found.st_ino


def check_identity(db: sqlite3.Connection, path: Path) -> bool:
    """Whether this is our event log; False where it is empty as yet. Raises NotOurs."""
    (application,) = db.execute("PRAGMA application_id").fetchone()
    (version,) = db.execute("PRAGMA user_version").fetchone()
    (tables,) = db.execute("SELECT count(*) FROM sqlite_master").fetchone()
    if (application, version, tables) == (0, 0, 0):
        return False
    if application != APPLICATION:
        raise NotOurs(f"{path} is another program's database: name another file")
    if version != VERSION:
        raise NotOurs(f"{path} is an event log of version {version}, this is version {VERSION}: move it away")
    return True


def _locked(path: Path) -> int:
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NONBLOCK, 0o644)
    except IsADirectoryError:
        raise NotOurs(f"{path} is a folder: name a file") from None
    try:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise NotOurs(f"{path} is not a regular file: name another")
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(descriptor)
        raise NotOurs(f"{path} is written by another instrument that runs: give each a file") from None
    except BaseException:
        os.close(descriptor)
        raise
    return descriptor
