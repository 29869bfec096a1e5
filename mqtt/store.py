"""Store of the values that the broker has not received: a SQLite file of limited size and age."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Callable
from contextlib import suppress
from typing import NamedTuple, TypeVar

from pneuforce.support.write_error import REMEDY

FILE_MODE = 0o600  #: of a new store; SQLite gives its -wal and -shm files the mode of the store
PAGE_BYTES = 4096
TRIM_INTERVAL = 64  #: number of appended records between two checks of size and age
TRIM_SHARE = 20  #: a full store loses one of this number of its records, the oldest ones

APPLICATION_ID = 0x50464D51  #: marks the files of this store, so that no file of another program is changed
_SCHEMA = f"""
    PRAGMA application_id = {APPLICATION_ID};
    CREATE TABLE record (id INTEGER PRIMARY KEY, utc_ms INTEGER NOT NULL, metrics BLOB NOT NULL);
    CREATE TABLE birth (only INTEGER PRIMARY KEY CHECK (only = 1), number INTEGER NOT NULL);
"""
_DAMAGED = frozenset({sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB})

Result = TypeVar("Result")


class HistoricalRecord(NamedTuple):
    """Encoded metrics of one time, flagged as historical."""

    number: int
    metrics: bytes


class DeliveryStore:
    """Records in the order in which they were appended.

    No method raises an exception because of the file. If the file cannot be written, new records are lost. A
    damaged file is renamed, and a new one is begun. `warn` receives a sentence for each of these events.
    """

    def __init__(self, path: str, max_bytes: float, max_age_s: float, warn: Callable[[str], None]) -> None:
        """Open or create the file. With an empty path, the records are in memory only."""
        self.path = path
        self._max_bytes, self._max_age_ms, self._warn = max_bytes, max_age_s * 1e3, warn
        self._db: sqlite3.Connection | None = None
        self._appended = 0
        self._birth_number = -1
        #: Records that were deleted or not stored since the start, and were never sent.
        self.lost = 0
        self.count = 0
        self.count = self._run(lambda db: _count(db), 0)

    def append(self, records: list[tuple[int, bytes]]) -> None:
        """Append records: the time [ms since 1970] and the encoded metrics of each."""
        statement = "INSERT INTO record (utc_ms, metrics) VALUES (?, ?)"
        written = self._run(lambda db: db.executemany(statement, records).rowcount, 0)
        self.count += written
        self.lost += len(records) - written
        if self._appended % TRIM_INTERVAL + len(records) >= TRIM_INTERVAL and records:
            self._trim(records[-1][0])
        self._appended += len(records)

    def oldest(self, max_records: int) -> list[HistoricalRecord]:
        """Return the oldest records."""
        query = "SELECT id, metrics FROM record ORDER BY id LIMIT ?"
        rows: list[tuple[int, bytes]] = self._run(lambda db: db.execute(query, (max_records,)).fetchall(), [])
        if not rows:
            self.count = 0
        return [HistoricalRecord(*row) for row in rows]

    def remove_through(self, number: int) -> None:
        """Remove a record and all older ones."""
        self._delete("id <= ?", number)

    def next_birth_number(self, modulus: int) -> int:
        """Return the number of the next connection. It follows the last one, also after a restart."""
        statement = """
            INSERT INTO birth VALUES (1, 0)
            ON CONFLICT (only) DO UPDATE SET number = (number + 1) % ? RETURNING number
        """
        following = (self._birth_number + 1) % modulus
        self._birth_number = self._run(
            lambda db: int(db.execute(statement, (modulus,)).fetchall()[0][0]), following
        )
        return self._birth_number

    def close(self) -> None:
        """Close the file."""
        if self._db is not None:
            with suppress(sqlite3.Error):
                self._db.close()
            self._db = None

    def _trim(self, utc_ms: int) -> None:
        """Remove the records that are too old, and the oldest ones of a full store."""
        self.lost += self._delete("utc_ms < ?", utc_ms - self._max_age_ms)
        if self._run(_used_bytes, 0) <= self._max_bytes:
            return
        deleted = self._delete("id <= (SELECT min(id) FROM record) + ?", self.count // TRIM_SHARE)
        self.lost += deleted
        self._warn(
            f"the store {self.path} has reached its size of {self._max_bytes / 1e6:g} MB: the oldest "
            f"{deleted} records were deleted"
        )

    def _delete(self, condition: str, value: float) -> int:
        """Delete the records that meet the condition. Return their number."""
        statement = f"DELETE FROM record WHERE {condition}"
        deleted = self._run(lambda db: db.execute(statement, (value,)).rowcount, 0)
        self.count -= deleted
        return deleted

    def _run(self, work: Callable[[sqlite3.Connection], Result], otherwise: Result) -> Result:
        """Return the result of `work` in a transaction, or `otherwise` if the file cannot be used."""
        try:
            self._db = db = self._db or _open(self.path)
            with db:
                return work(db)
        except sqlite3.Error as error:
            self.close()
            code = getattr(error, "sqlite_errorcode", 0) & 0xFF
            if code in _DAMAGED:
                self._replace(error)
            else:
                self._warn(
                    f"the store {self.path} cannot be used: {error}; values are lost while the broker cannot "
                    f"be reached: {REMEDY}"
                )
            return otherwise

    def _replace(self, error: sqlite3.Error) -> None:
        """Rename a damaged file. The next access creates a new one."""
        self.lost += self.count
        self.count = 0
        for suffix in ("-wal", "-shm"):
            with suppress(OSError):
                os.unlink(self.path + suffix)
        damaged = f"{self.path}.damaged"
        with suppress(OSError):
            os.replace(self.path, damaged)
        self._warn(
            f"the store {self.path} is damaged ({error}): it was renamed to {damaged}; a new one begins"
        )


def _open(path: str) -> sqlite3.Connection:
    if path:
        with suppress(OSError):  # SQLite reports this error
            os.close(os.open(path, os.O_RDWR | os.O_CREAT, FILE_MODE))
    db = sqlite3.connect(path or ":memory:", timeout=1.0)
    try:
        db.execute("PRAGMA synchronous = NORMAL")  # a power failure loses the last seconds, not the file
        application_id = db.execute("PRAGMA application_id").fetchone()[0]
        if application_id != APPLICATION_ID:
            if db.execute("PRAGMA schema_version").fetchone()[0]:
                raise sqlite3.DatabaseError("the file belongs to another program")
            db.executescript(f"BEGIN; {_SCHEMA} COMMIT;")
        db.execute("PRAGMA journal_mode = WAL")
    except sqlite3.Error:
        db.close()
        raise
    return db


def _count(db: sqlite3.Connection) -> int:
    return int(db.execute("SELECT count(*) FROM record").fetchone()[0])


def _used_bytes(db: sqlite3.Connection) -> int:
    pages = db.execute("PRAGMA page_count").fetchone()[0] - db.execute("PRAGMA freelist_count").fetchone()[0]
    return int(pages) * PAGE_BYTES
