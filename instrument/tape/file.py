"""The file of a recording: made once, written by one process, readable meanwhile and after its death."""

from __future__ import annotations

import errno
import json
import math
import os
import sqlite3
import struct
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from instrument.errors import ConfigurationError, PneuforceError
from instrument.tape.entry import INPUTS, Entry, Kind, TapeError, encode
from instrument.tape.measured import Measured, unpack
from instrument.tape.schema import CREATE, How, checksum, insert_into, sample_checksum

#: SQLite syncs at a checkpoint: so many pages, five seconds of samples, are what a power cut may cost.
CHECKPOINT_PAGES = 200
CLOSE_WAIT_MS = 200  #: for who reads meanwhile; a recorder that ends waits no longer
#: What may lie beside a recording; SQLite would take it for this file's own.
BESIDE = ("-wal", "-shm", "-journal")


class Unwritable(PneuforceError, OSError):
    """The file of a recording takes no more; what was committed before stays whole."""


class TapeFile:
    """A new recording. What is put waits for a commit, after which the file has all of it, or nothing.

    Raises ConfigurationError where the file is there already or cannot be made.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.begin_s = math.nan  #: when the recording begins; NaN until it does
        self.kept_s = math.nan  #: time of the newest entry that is committed
        self.samples = 0
        self.kept = 0  #: samples that are committed
        self.events = 0
        self.last: Measured | None = None
        self._batches = 0
        self._now_s = math.nan
        self._inputs: list[Entry] = []
        self._rows: dict[str, list[tuple[Any, ...]]] = {}
        self._identity = _make(path)
        try:
            self._db = self._opened()
        except (sqlite3.Error, OSError) as error:
            path.unlink(missing_ok=True)
            why = getattr(error, "strerror", None) or error
            raise ConfigurationError(f"{path} cannot be made: {why}") from None

    def _opened(self) -> sqlite3.Connection:
        db = sqlite3.connect(self.path, isolation_level=None)
        try:
            db.execute("PRAGMA journal_size_limit = 8000000")
            db.executescript(CREATE)  # first, so that the file itself says whose it is
            (mode,) = db.execute("PRAGMA journal_mode = WAL").fetchone()
            if mode != "wal":
                raise OSError(errno.ENOTSUP, "SQLite's write-ahead log does not work on this file system")
            db.execute("PRAGMA synchronous = NORMAL")
            db.execute(f"PRAGMA wal_autocheckpoint = {CHECKPOINT_PAGES}")
        except BaseException:
            db.close()
            raise
        return db

    @property
    def begun(self) -> bool:
        """Whether it is known what instrument is recorded."""
        return math.isfinite(self.begin_s)

    @property
    def extent_s(self) -> float:
        """Time from the beginning to the newest entry that is committed [s]; 0 before it."""
        return max(self.kept_s - self.begin_s, 0.0) if self.kept_s == self.kept_s else 0.0

    @property
    def bytes(self) -> int:
        """Size of the file and of what SQLite still keeps beside it."""
        return sum(file.stat().st_size for file in _and_beside(self.path) if file.exists())

    def put(self, entry: Entry) -> None:
        """Take an entry of the tape. Raises TapeError where it is none that a recording has."""
        self._now_s = entry.t_s
        if entry.kind in INPUTS:
            self._inputs.append(entry)
        elif take := _TAKERS.get(entry.kind):
            try:
                take(self, entry)
            except (struct.error, UnicodeError) as error:
                raise TapeError(
                    f"an entry of kind {entry.kind.name} is none of this version: {error}"
                ) from None
        else:
            raise TapeError(f"a recording has no entries of kind {entry.kind.name}")

    def end(self, how: How, why: str) -> None:
        """Say how the recording ended: no entry comes after that."""
        self._add("ending", 1, self._now_s, how.value, why, self.samples)

    def commit(self) -> None:
        """Put on the disk what waits, all or nothing. Raises Unwritable, and the recording is then over."""
        self._close_batch()
        if not self._rows:
            return
        try:
            self._check_in_place()
            self._db.execute("BEGIN IMMEDIATE")
            for table, rows in self._rows.items():
                self._db.executemany(insert_into(table), rows)
            self._db.execute("COMMIT")
        except sqlite3.Error as error:
            with suppress(sqlite3.Error):
                self._db.execute("ROLLBACK")
            raise Unwritable(_in_words(error)) from None
        self._rows.clear()
        self.kept, self.kept_s = self.samples, self._now_s

    def close(self) -> None:
        """Give the file back. What was put and not committed is lost; a full disk does not matter here."""
        with suppress(sqlite3.Error):
            self._db.execute(f"PRAGMA busy_timeout = {CLOSE_WAIT_MS}")
            self._db.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        with suppress(sqlite3.Error):
            self._db.close()

    def discard(self) -> None:
        """Close a recording that never began, and leave nothing of it."""
        self.close()
        for file in _and_beside(self.path):
            file.unlink(missing_ok=True)

    # ---- rows

    def _add(self, table: str, *row: Any, reckon: Callable[[Any], int] = checksum) -> None:
        self._rows.setdefault(table, []).append((*row, reckon(row)))

    def _close_batch(self) -> None:
        if self._inputs:
            self._batches += 1
            self._add("tape", self._batches, self._inputs[0].t_s, b"".join(map(encode, self._inputs)))
            self._inputs.clear()

    def _begin(self, entry: Entry) -> None:
        self.begin_s = entry.t_s
        facts = {"begin_s": entry.t_s, **_table(entry)}  # first, for nothing can be read without it
        for number, (key, value) in enumerate(facts.items(), 1):
            self._add("about", number, key, json.dumps(value))

    def _checkpoint(self, entry: Entry) -> None:
        self._add("checkpoint", 1, entry.t_s, entry.body)

    def _measured(self, entry: Entry) -> None:
        self.last = unpack(entry.body)
        self.samples += 1
        values = [None if value != value else value for value in self.last]
        self._add("samples", self.samples, *values, reckon=sample_checksum)

    def _event(self, entry: Entry) -> None:
        self.events += 1
        self._add("events", self.events, entry.t_s, str(_table(entry).get("at", "")), entry.body.decode())

    def _check_in_place(self) -> None:
        """SQLite would go on writing to a file that has no name any more."""
        try:
            found = os.stat(self.path)
        except FileNotFoundError:
            found = None
        if found is None or (found.st_dev, found.st_ino) != self._identity:
            raise Unwritable("the file was taken away, or another put in its place")


_TAKERS: Mapping[Kind, Callable[[TapeFile, Entry], None]] = {
    Kind.BEGIN: TapeFile._begin,
    Kind.CHECKPOINT: TapeFile._checkpoint,
    Kind.MEASURED: TapeFile._measured,
    Kind.EVENT: TapeFile._event,
}


def _table(entry: Entry) -> dict[str, Any]:
    facts = entry.facts
    if isinstance(facts, dict):
        return facts
    raise TapeError(f"an entry of kind {entry.kind.name} is no table of facts")


def refuse_taken(path: Path) -> None:
    """Raises ConfigurationError where something lies there already: nobody makes a recording twice."""
    for file in _and_beside(path):
        if os.path.lexists(file):
            beside = "" if file == path else ", left by a recording that was moved without it"
            raise ConfigurationError(f"{file} is there already{beside}: choose another name")


def _make(path: Path) -> tuple[int, int]:
    """Make the file, for this user alone; what tells it from another that takes its name."""
    refuse_taken(path)
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o600)
    except FileExistsError:
        raise ConfigurationError(f"{path} is there already: choose another name") from None
    except OSError as error:
        raise ConfigurationError(f"{path} cannot be made: {error.strerror}") from None
    made = os.fstat(descriptor)
    os.close(descriptor)
    return made.st_dev, made.st_ino


def _and_beside(path: Path) -> tuple[Path, ...]:
    return path, *(Path(f"{path}{end}") for end in BESIDE)


def _in_words(error: sqlite3.Error) -> str:
    """What SQLite says, and what it means: it does not always know that a disk is full."""
    io = getattr(error, "sqlite_errorcode", 0) & 0xFF == sqlite3.SQLITE_IOERR
    return f"{error}{': is the disk full, or the file larger than it may be?' if io else ''}"
