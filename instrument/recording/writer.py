"""Writer of a recording. The file is readable while it is written and after its process was killed."""

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

from pneuforce.errors import ConfigurationError, PneuforceError
from pneuforce.instrument.recording.schema import (
    CREATE_TABLES,
    EndReason,
    checksum,
    insert_into,
    sample_checksum,
)
from pneuforce.instrument.stream.entry import INPUTS, EntryKind, StreamEntry, StreamError, encode
from pneuforce.instrument.stream.sample_record import SampleRecord, unpack
from pneuforce.support.write_error import REMEDY, is_disk_error, write_error

#: SQLite syncs its log after this number of pages. A power cut loses at most these pages, which are 5 s of
#: samples.
CHECKPOINT_PAGES = 200
CLOSE_WAIT_MS = 200  #: longest time for which `close` waits for readers of the file
#: Suffixes of the additional files of a recording, which SQLite creates in the same folder.
SIDE_FILE_SUFFIXES = ("-wal", "-shm", "-journal")


class RecordingWriteError(PneuforceError, OSError):
    """Failure to write to a recording. The committed part stays readable."""


class RecordingWriter:
    """Writer of a new recording. A commit writes all added entries, or none of them.

    Raises ConfigurationError if the file exists already or cannot be created, RecordingWriteError if the disk
    is full.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.begin_s = math.nan  #: time of the header; NaN before the header was added
        self.committed_s = math.nan  #: time of the newest committed entry
        self.samples = 0
        self.committed_samples = 0
        self.events = 0
        self.last_sample: SampleRecord | None = None
        self._batches = 0
        self._now_s = math.nan
        self._inputs: list[StreamEntry] = []
        self._rows: dict[str, list[tuple[Any, ...]]] = {}
        self._identity = _create_file(path)
        try:
            self._db = self._open()
        except (sqlite3.Error, OSError) as error:
            path.unlink(missing_ok=True)
            if isinstance(error, sqlite3.Error) and _is_disk_error(error):
                raise RecordingWriteError(f"{path} cannot be created: {_format_error(error)}") from None
            why = getattr(error, "strerror", None) or error
            raise ConfigurationError(f"{path} cannot be created: {why}") from None

    def _open(self) -> sqlite3.Connection:
        db = sqlite3.connect(self.path, isolation_level=None)
        try:
            db.execute("PRAGMA journal_size_limit = 8000000")
            # Create the tables before WAL is enabled, so that the file itself contains the application id.
            db.executescript(CREATE_TABLES)
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
    def has_header(self) -> bool:
        """Return True if the header of the instrument was added."""
        return math.isfinite(self.begin_s)

    @property
    def extent_s(self) -> float:
        """Return the time from the beginning to the newest committed entry [s]; 0 before the first commit."""
        return 0.0 if math.isnan(self.committed_s) else max(self.committed_s - self.begin_s, 0.0)

    @property
    def size_bytes(self) -> int:
        """Return the size of the recording, including the additional files of SQLite."""
        return sum(file.stat().st_size for file in _with_side_files(self.path) if file.exists())

    def add_entry(self, entry: StreamEntry) -> None:
        """Add an entry for the next commit. Raises StreamError if a recording cannot contain the entry."""
        self._now_s = entry.t_s
        if entry.kind in INPUTS:
            self._inputs.append(entry)
        elif add := _ADDERS.get(entry.kind):
            try:
                add(self, entry)
            except (struct.error, UnicodeError) as error:
                raise StreamError(
                    f"an entry of kind {entry.kind.name} does not have the format of this version: {error}"
                ) from None
        else:
            raise StreamError(f"a recording has no entries of kind {entry.kind.name}")

    def end(self, reason: EndReason, why: str) -> None:
        """Add the reason why the recording ends. No entry may follow."""
        self._add_row("ending", 1, self._now_s, reason.value, why, self.samples)

    def commit(self) -> None:
        """Write all added entries in one transaction.

        Raises RecordingWriteError if the entries cannot be written. The recording must then be closed.
        """
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
            raise RecordingWriteError(_format_error(error)) from None
        self._rows.clear()
        self.committed_samples, self.committed_s = self.samples, self._now_s

    def close(self) -> None:
        """Close the file. Entries that are not committed are lost. Errors of SQLite are ignored."""
        with suppress(sqlite3.Error):
            self._db.execute(f"PRAGMA busy_timeout = {CLOSE_WAIT_MS}")
            self._db.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        with suppress(sqlite3.Error):
            self._db.close()

    def discard(self) -> None:
        """Close the recording and delete all its files."""
        self.close()
        for file in _with_side_files(self.path):
            file.unlink(missing_ok=True)

    # ---- rows

    def _add_row(self, table: str, *row: Any, checksum_of: Callable[[Any], int] = checksum) -> None:
        self._rows.setdefault(table, []).append((*row, checksum_of(row)))

    def _close_batch(self) -> None:
        if self._inputs:
            self._batches += 1
            entries = b"".join(map(encode, self._inputs))
            self._add_row("inputs", self._batches, self._inputs[0].t_s, entries)
            self._inputs.clear()

    def _add_header(self, entry: StreamEntry) -> None:
        self.begin_s = entry.t_s
        # `begin_s` is in the first row, because a reader needs it even if a later row is damaged.
        header = {"begin_s": entry.t_s, **_json_object(entry)}
        for number, (key, value) in enumerate(header.items(), 1):
            self._add_row("about", number, key, json.dumps(value))

    def _add_checkpoint(self, entry: StreamEntry) -> None:
        self._add_row("checkpoint", 1, entry.t_s, entry.body)

    def _add_sample(self, entry: StreamEntry) -> None:
        self.last_sample = unpack(entry.body)
        self.samples += 1
        values = [None if value != value else value for value in self.last_sample]
        self._add_row("samples", self.samples, *values, checksum_of=sample_checksum)

    def _add_event(self, entry: StreamEntry) -> None:
        self.events += 1
        utc = str(_json_object(entry).get("at", ""))
        self._add_row("events", self.events, entry.t_s, utc, entry.body.decode())

    def _check_in_place(self) -> None:
        """Raise RecordingWriteError if the file was removed. SQLite itself does not detect a removed file."""
        try:
            found = os.stat(self.path)
        except FileNotFoundError:
            found = None
        if found is None or (found.st_dev, found.st_ino) != self._identity:
            raise RecordingWriteError("the file was removed, moved or replaced")


_ADDERS: Mapping[EntryKind, Callable[[RecordingWriter, StreamEntry], None]] = {
    EntryKind.HEADER: RecordingWriter._add_header,
    EntryKind.CHECKPOINT: RecordingWriter._add_checkpoint,
    EntryKind.SAMPLE: RecordingWriter._add_sample,
    EntryKind.EVENT: RecordingWriter._add_event,
}


def _json_object(entry: StreamEntry) -> dict[str, Any]:
    value = entry.json_body
    if isinstance(value, dict):
        return value
    raise StreamError(f"an entry of kind {entry.kind.name} is not a JSON object")


def check_path_unused(path: Path) -> None:
    """Raise ConfigurationError if the file or an additional file of SQLite exists.

    A recording is never overwritten.
    """
    for file in _with_side_files(path):
        if os.path.lexists(file):
            beside = "" if file == path else " (left by a recording that was moved without this file)"
            raise ConfigurationError(f"{file} exists already{beside}: choose another name")


def _create_file(path: Path) -> tuple[int, int]:
    """Create the file with access for this user only. Return its device and inode numbers."""
    check_path_unused(path)
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o600)
    except FileExistsError:
        raise ConfigurationError(f"{path} exists already: choose another name") from None
    except OSError as error:
        failure = write_error(path, error)
        raise (RecordingWriteError(str(failure)) if is_disk_error(error) else failure) from None
    created = os.fstat(descriptor)
    os.close(descriptor)
    return created.st_dev, created.st_ino


def _with_side_files(path: Path) -> tuple[Path, ...]:
    return path, *(Path(f"{path}{suffix}") for suffix in SIDE_FILE_SUFFIXES)


def _format_error(error: sqlite3.Error) -> str:
    """Return the message of SQLite. For an error of the disk, add what to check."""
    remedy = f": is the disk full, or the file at its size limit? Remedy: {REMEDY}"
    return f"{error}{remedy if _is_disk_error(error) else ''}"


def _is_disk_error(error: sqlite3.Error) -> bool:
    return getattr(error, "sqlite_errorcode", 0) & 0xFF in (sqlite3.SQLITE_IOERR, sqlite3.SQLITE_FULL)
