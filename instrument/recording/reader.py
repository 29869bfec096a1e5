"""Reader of a recording.

The recording may still be written, its recorder may have been killed, or the file may be damaged. The reader
returns only the rows before the first damaged row.
"""

from __future__ import annotations

import math
import sqlite3
import struct
from bisect import bisect_left
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.recording.schema import (
    SAMPLE_TYPES,
    STOP_REQUESTED,
    TABLES,
    EndReason,
    checksum,
    sample_checksum,
    select_from,
)
from pneuforce.instrument.stream.entry import EntryDecoder, EntryKind, StreamEntry, StreamError, parse_json
from pneuforce.instrument.stream.sample_record import SampleRecord, is_valid
from pneuforce.support.counted import counted
from pneuforce.support.printable import printable

ROWS_PER_QUERY = 1000
MAX_TIME_S = 1e11  #: limit of a valid time: three thousand years after the boot of the computer
MAX_SHOWN = 300  #: number of characters of a text in the file that are shown
EMPTY_REASON = "nothing was recorded, or the file was copied without its -wal file"
_BOOL_COLUMNS = [i for i, kind in enumerate(SAMPLE_TYPES.values()) if kind is bool]


class RecordingEnd(NamedTuple):
    """End of a recording and its reason."""

    t_s: float
    how: str  #: reason, a value of `EndReason`
    why: str
    samples: int  #: number of recorded samples

    @property
    def requested(self) -> bool:
        """Return True if a user stopped the recording or the instrument."""
        return self.how == EndReason.STOPPED or (self.how, self.why) == (EndReason.END, STOP_REQUESTED)


class Recording:
    """Recording that is open for reading, with the rows that existed when it was opened.

    The iterators end before the first damaged row. `damage` then describes the damage. Damage of the samples
    takes precedence, so that all programs report the same damage.
    """

    def __init__(self, path: Path, db: sqlite3.Connection) -> None:
        """Read the header of the recording. Raises ConfigurationError if the header cannot be read."""
        self.path = path
        self.damage = ""
        self._are_samples_damaged = False
        self._db = db
        self._last = self._last_numbers()
        self.metadata: Mapping[str, Any] = {}  #: header of the instrument, and `begin_s`
        try:
            self.metadata = {str(key): parse_json(value) for key, value in self._rows("about")}
            self.begin_s = float(self.metadata["begin_s"])
        except (KeyError, TypeError, ValueError, OverflowError):
            raise ConfigurationError(
                f"{path} contains no recording ({self.damage or EMPTY_REASON})"
            ) from None
        if not 0 <= self.begin_s <= MAX_TIME_S:
            raise ConfigurationError(f"{path} is not a recording: its begin_s is {self.begin_s:g} s")
        if self.ending and self.ending.samples != self._last["samples"] is not None:
            self.damage = f"it has {self._last['samples']} of {counted(self.ending.samples, 'sample')}"

    # ---- contents; all times are on the monotonic clock of the host process

    @property
    def checkpoint(self) -> StreamEntry | None:
        """Return the state of the session at the beginning, or None if the state is damaged."""
        for t_s, state in self._rows("checkpoint"):
            return StreamEntry(EntryKind.CHECKPOINT, t_s, state) if isinstance(state, bytes) else None
        return None

    @property
    def ending(self) -> RecordingEnd | None:
        """Return the end; None if the recorder was killed, could not write, or still writes."""
        for row in self._rows("ending"):
            t_s, how, why, samples = row
            return RecordingEnd(t_s, short_text(how), short_text(why), samples)
        return None

    def entries(self) -> Iterator[StreamEntry]:
        """Yield all inputs in order of time."""
        for _, batch in self._rows("inputs"):
            try:
                entries = EntryDecoder().feed(batch)
            except (StreamError, TypeError) as error:  # the checksum is correct, but the entries are invalid
                self.damage = str(error)
                return
            for entry in entries:
                if not 0 <= entry.t_s <= MAX_TIME_S:
                    self.damage = f"an entry of kind {entry.kind.name} has no valid time"
                    return
                yield entry

    def samples(self, from_s: float = -math.inf, to_s: float = math.inf) -> Iterator[SampleRecord]:
        """Yield the samples from `from_s` to `to_s`, both counted from the beginning of the recording [s]."""
        low_s, high_s = self.begin_s + from_s, self.begin_s + to_s
        first = 1 if from_s == -math.inf else self._first_sample(low_s)
        for number, row in enumerate(self._rows("samples", first, sample_checksum), first):
            sample = _sample_of(row)
            if sample is None or not abs(sample.t_s) <= MAX_TIME_S:
                self.damage = f"sample {number} has {'no valid time' if sample else 'invalid values'}"
                return
            if sample.t_s > high_s:
                return
            if sample.t_s >= low_s:
                yield sample

    def events(self) -> Iterator[Mapping[str, Any]]:
        """Yield the records that the event log received during the recording, in order."""
        for t_s, _, body in self._rows("events"):
            try:
                yield dict(parse_json(body))
            except (TypeError, ValueError) as error:  # correct checksum, but invalid JSON
                self.damage = f"the event at {short_text(t_s)} s is invalid: {error}"
                return

    @property
    def simulated(self) -> bool:
        """Return True if the header or the first event of a board reports a simulated rig."""
        boards = (record.get("is") for record in self.events() if record.get("kind") == "board")
        return bool(self.metadata.get("simulated")) or not str(next(boards, "real")).startswith("real")

    # ---- extent

    @property
    def sample_count(self) -> int | None:
        """Return the number of recorded samples, or None if the file is too damaged."""
        return self._last["samples"]

    @property
    def begin_utc_s(self) -> float:
        """Return the beginning of the recording in seconds since 1970 (UTC), NaN if it is not known."""
        utc_us = self.metadata.get("utc_us")
        return utc_us / 1e6 if isinstance(utc_us, int) and 0 < utc_us < 1e6 * MAX_TIME_S else math.nan

    @property
    def extent_s(self) -> float:
        """Return the time from the beginning to the last sample [s], or NaN if that sample cannot be read."""
        return self._time_of(self.sample_count or 0) - self.begin_s

    def no_samples(self) -> str:
        """Return the sentence for a time range without samples. Call this method after reading the range."""
        count = counted(self.sample_count or 0, "sample")
        why = self.remark() or f"{self.path} has {count} in {self.extent_s:.1f} s"
        return f"there are no samples in this time range: {why}"

    def remark(self) -> str:
        """Return a sentence about damage found so far, or about an unexpected end.

        The sentence is empty if the recording is intact and was stopped by a user.
        """
        if self.damage:
            return f"{self.path} is damaged: {short_text(self.damage)}; another copy may contain more"
        ending = self.ending
        if ending is not None and ending.requested:
            return ""
        why = "has no end (it is still written, the disk was full, or its recorder was killed)"
        if ending is not None:
            why = f"ended unexpectedly ({ending.how}: {ending.why})"
        return f"{self.path} {why}: {self._intact_part()}"

    def _intact_part(self) -> str:
        count = self.sample_count or 0
        if not count:
            return "it contains no sample"
        samples = counted(count, "sample is", "samples are")
        if math.isnan(self.extent_s):
            return f"the last of {counted(count, 'sample')} cannot be read"
        return f"{self.extent_s:.1f} s, {samples} intact"

    # ---- rows

    def _rows(
        self, table: str, first: int = 1, checksum_of: Callable[[Sequence[Any]], int] = checksum
    ) -> Iterator[tuple[Any, ...]]:
        """Yield the rows of a table, without number and checksum, up to the first missing or damaged row."""
        last, why = self._last[table], ""
        while last is None or first <= last:
            rows, why = self._read(table, first, ROWS_PER_QUERY if last is None else last + 1 - first)
            for row in rows:
                if row[0] != first or not _is_intact(row, checksum_of):
                    why = f"row {first} has a wrong checksum or number"
                    break
                yield row[1:-1]
                first += 1
            if why or not rows:
                self._set_damage(table, first - 1, why or f"row {first} is missing")
                return

    def _read(self, table: str, first: int, count: int) -> tuple[list[tuple[Any, ...]], str]:
        """Return at most `count` rows from number `first` on, and the error that ended the query."""
        rows: list[tuple[Any, ...]] = []
        try:
            rows.extend(self._db.execute(select_from(table), (first, min(count, ROWS_PER_QUERY))))
        except sqlite3.Error as error:
            return rows, str(error)
        return rows, ""

    def _set_damage(self, table: str, intact: int, why: str) -> None:
        if self._are_samples_damaged and table != "samples":
            return
        self._are_samples_damaged = table == "samples"
        in_time = table == "samples" and intact
        until = f", up to {self._time_of(intact) - self.begin_s:.1f} s," if in_time else ""
        rows = f"{counted(intact, 'row')} of {table}{until}" if intact else f"no row of {table}"
        self.damage = f"{rows} {'are' if intact > 1 else 'is'} intact ({why})"

    def _last_numbers(self) -> dict[str, int | None]:
        """Return the last row number of each table, read in one transaction."""
        with suppress(sqlite3.Error):
            self._db.execute("BEGIN")
        last = {table: self._last_number(table) for table in TABLES}
        with suppress(sqlite3.Error):
            self._db.execute("COMMIT")
        return last

    def _last_number(self, table: str) -> int | None:
        try:
            return int(self._db.execute(f"SELECT ifnull(max(number), 0) FROM {table}").fetchone()[0])
        except sqlite3.Error as error:
            self.damage = f"the last row of {table} cannot be read ({error})"
            return None

    def _time_of(self, number: int) -> float:
        """Return the time of a sample [s], or NaN if the sample cannot be read."""
        with suppress(sqlite3.Error):
            row = self._db.execute("SELECT t_s FROM samples WHERE number = ?", (number,)).fetchone()
            if row and isinstance(row[0], float) and abs(row[0]) <= MAX_TIME_S:
                return row[0]
        return math.nan

    def _first_sample(self, low_s: float) -> int:
        """Return the number of the first sample at or after `low_s`."""
        return 1 + bisect_left(range(1, 1 + (self.sample_count or 0)), low_s, key=self._time_of)


def short_text(value: object) -> str:
    """Return a value from a file as a short text without control characters, for a message or a figure."""
    text = printable(str(value)[: MAX_SHOWN + 1])
    return f"{text[:MAX_SHOWN]}…" if len(text) > MAX_SHOWN else text


def _sample_of(row: tuple[Any, ...]) -> SampleRecord | None:
    """Return the sample in a row, or None if a value has an invalid type or range."""
    values = [math.nan if value is None else value for value in row]
    for i in _BOOL_COLUMNS:
        if values[i] not in (0, 1):
            return None
        values[i] = bool(values[i])
    sample = SampleRecord._make(values)
    return sample if is_valid(sample) else None


def _is_intact(row: tuple[Any, ...], checksum_of: Callable[[Sequence[Any]], int]) -> bool:
    try:
        return bool(checksum_of(row[:-1]) == row[-1])
    except (TypeError, ValueError, OverflowError, struct.error):
        return False
