"""File of the event log: a SQLite table that only grows, written by one process at a time."""

from __future__ import annotations

import errno
import fcntl
import os
import sqlite3
import stat
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from pathlib import Path

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.audit.record import GENESIS, chain_digest
from pneuforce.support.readonly_sqlite import open_readonly, reject_generated_columns

APPLICATION = 0x504E4576  #: application id in the header of the file, which identifies an event log
VERSION = 1
FILE_MODE = 0o600  #: of a new log; SQLite gives its -wal and -shm files the mode of the log
LOCK_WAIT_S = 1.0
CLOSE_WAIT_MS = 200  #: longest time for which `close` waits until other processes have read the file

_SCHEMA = f"""
    BEGIN IMMEDIATE;
    PRAGMA application_id = {APPLICATION};
    PRAGMA user_version = {VERSION};
    CREATE TABLE records (number INTEGER PRIMARY KEY, body TEXT NOT NULL, digest BLOB NOT NULL);
    CREATE TRIGGER no_update BEFORE UPDATE ON records BEGIN SELECT RAISE(ABORT, 'append only'); END;
    CREATE TRIGGER no_delete BEFORE DELETE ON records BEGIN SELECT RAISE(ABORT, 'append only'); END;
    COMMIT;
"""

_DAMAGE_CODES = {sqlite3.SQLITE_NOTADB, sqlite3.SQLITE_CORRUPT}


class EventLogFileError(ConfigurationError):
    """File that is not an event log of this version, is damaged, or is written by another instrument."""


class EventLogInUse(EventLogFileError):
    """Event log that another running instrument writes."""


class EventLogFile:
    """Event log that is open for appending.

    Methods raise OSError or sqlite3.Error if the disk does not permit the operation. The constructor also
    raises EventLogFileError.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._size = 0  # size of the file at the last check
        wal = Path(f"{path}-wal")
        _reject_orphaned_log(path, wal)
        # SQLite holds its locks only during transactions, so the file has a separate lock. The descriptor of
        # this lock is closed last: closing any descriptor of a file drops the POSIX locks that SQLite has on
        # this file.
        self._lock = _open_locked(path)
        try:
            with _reported_damage(path):
                self._open()
            self._side_files = {file: _identity(file) for file in (wal, Path(f"{path}-shm"))}
        except BaseException:
            os.close(self._lock)
            raise

    def _open(self) -> None:
        self._db = sqlite3.connect(
            self._path, isolation_level=None, check_same_thread=False, timeout=LOCK_WAIT_S
        )
        try:
            self._prepare()
            self._last = _read_last(self._db, self._path)
        except BaseException:
            self._db.close()
            raise

    def _prepare(self) -> None:
        for pragma in ("journal_size_limit = 8000000", "synchronous = FULL"):
            self._db.execute(f"PRAGMA {pragma}")
        exists = check_file_type(self._db, self._path)
        if exists:
            _reject_damaged_structure(self._db, self._path)
        (mode,) = self._db.execute("PRAGMA journal_mode = WAL").fetchone()
        if mode != "wal":
            raise OSError(errno.ENOTSUP, "SQLite's write-ahead log does not work on this file system")
        if not exists:
            self._db.executescript(_SCHEMA)

    @property
    def record_count(self) -> int:
        """Return the number of records."""
        return self._last[0]

    @property
    def head(self) -> bytes:
        """Return the digest of the last record."""
        return self._last[1]

    def append(self, bodies: Sequence[bytes]) -> None:
        """Append all records or no record. When this method returns, the records are on the disk."""
        rows = self.rows_of(bodies)
        self._db.execute("BEGIN IMMEDIATE")
        try:
            self._db.executemany("INSERT INTO records VALUES (?, ?, ?)", rows)
            self._db.execute("COMMIT")
        except BaseException:
            with suppress(sqlite3.Error):
                self._db.execute("ROLLBACK")
            raise
        self._last = rows[-1][0], rows[-1][2]

    def rows_of(self, bodies: Sequence[bytes]) -> list[tuple[int, str, bytes]]:
        """Return the rows that `append` would write: number, body and digest."""
        rows, (last, digest) = [], self._last
        for number, body in enumerate(bodies, last + 1):
            digest = chain_digest(digest, body)
            rows.append((number, body.decode(), digest))
        return rows

    def check_in_place(self) -> None:
        """Raise OSError if the file was truncated, or if the file or one of its side files was replaced.

        The side files are the -wal file and the -shm file of SQLite. A removed file counts as replaced.
        """
        opened = os.fstat(self._lock)
        if opened.st_size < self._size:
            raise OSError(errno.ESTALE, f"{self._path.name} was truncated")
        self._size = opened.st_size
        for file, identity in {self._path: (opened.st_dev, opened.st_ino), **self._side_files}.items():
            if _identity(file) != identity:
                raise OSError(errno.ESTALE, f"{file.name} was removed, moved or replaced")

    def close(self) -> None:
        """Close the file. Before that, move the contents of the write-ahead log (WAL) into the file.

        A renamed file needs this, because SQLite would not find its WAL under the new name. The WAL of a
        deleted file is kept, because a copy of the file may need this WAL.
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


def check_event_log(path: Path) -> None:
    """Raise ConfigurationError if no instrument could append to the file. The file is only read.

    A missing or empty file can be used.
    """
    _reject_orphaned_log(path, Path(f"{path}-wal"))
    if not path.exists():
        return
    with _reported_damage(path), closing(open_readonly(path)) as db:
        if check_file_type(db, path):
            reject_generated_columns(db, path)
            _reject_damaged_structure(db, path)
            _read_last(db, path)


@contextmanager
def _reported_damage(path: Path) -> Iterator[None]:
    """Convert the errors of SQLite about a damaged file to EventLogFileError."""
    try:
        yield
    except sqlite3.DatabaseError as error:
        if getattr(error, "sqlite_errorcode", 0) & 0xFF not in _DAMAGE_CODES:
            raise
        raise EventLogFileError(
            f"{path} is not an event log, or it is damaged ({error}): move the file away"
        ) from None


def structure_damage(db: sqlite3.Connection) -> str:
    """Return what is wrong with the structure of a file, "" if it is intact. The complete file is read.

    Changed records in an intact structure are found only by the verification of the digests. Raises
    sqlite3.Error if SQLite cannot read the file.
    """
    db.execute("PRAGMA ignore_check_constraints = ON")  # a constraint from the file could take hours
    (found,) = db.execute("PRAGMA quick_check(1)").fetchone()
    return "" if found == "ok" else str(found).splitlines()[-1]


def _reject_damaged_structure(db: sqlite3.Connection, path: Path) -> None:
    if damage := structure_damage(db):
        raise EventLogFileError(f"{path} is a damaged event log ({damage}): move the file away")


def _read_last(db: sqlite3.Connection, path: Path) -> tuple[int, bytes]:
    """Return the number and the digest of the last record."""
    query = "SELECT number, digest FROM records ORDER BY number DESC LIMIT 1"
    number, digest = db.execute(query).fetchone() or (0, GENESIS)
    if not isinstance(digest, bytes) or len(digest) != len(GENESIS):
        raise EventLogFileError(
            f"{path} is a damaged event log (record {number} has no digest): move the file away"
        )
    return number, digest


def _reject_orphaned_log(path: Path, wal: Path) -> None:
    """Raise EventLogFileError if the write-ahead log has records but the file is empty or missing.

    SQLite would delete these records.
    """
    if wal.is_file() and wal.stat().st_size and not (path.exists() and path.stat().st_size):
        raise EventLogFileError(
            f"{wal} contains records of an event log that was moved without this file: move it to that log "
            "and give it the name of that log with -wal appended, or delete it"
        )


def _identity(file: Path) -> tuple[int, int] | None:
    """Return the device and inode numbers of a file, or None if there is no such file."""
    try:
        found = file.stat()
    except FileNotFoundError:
        return None
    return found.st_dev, found.st_ino


def check_file_type(db: sqlite3.Connection, path: Path) -> bool:
    """Return True for an event log and False for an empty file. Raises EventLogFileError for other files."""
    (application,) = db.execute("PRAGMA application_id").fetchone()
    (version,) = db.execute("PRAGMA user_version").fetchone()
    (tables,) = db.execute("SELECT count(*) FROM sqlite_master").fetchone()
    if (application, version, tables) == (0, 0, 0):
        return False
    if application != APPLICATION:
        raise EventLogFileError(f"{path} is the database of another program: name another file")
    if version != VERSION:
        raise EventLogFileError(
            f"{path} is an event log of format version {version}, and this program uses version {VERSION}: "
            "move the file away"
        )
    return True


def _open_locked(path: Path) -> int:
    """Open the file and lock it. Return the descriptor of the file."""
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NONBLOCK, FILE_MODE)
    except IsADirectoryError:
        raise EventLogFileError(f"{path} is a folder: name a file") from None
    try:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise EventLogFileError(f"{path} is not a regular file: name another file")
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(descriptor)
        raise EventLogInUse(
            f"{path} is written by another running instrument: if this configuration is not running already, "
            "give each instrument its own file"
        ) from None
    except BaseException:
        os.close(descriptor)
        raise
    return descriptor
