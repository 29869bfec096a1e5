"""A recording as it is read, also while it is written, after a kill, or cut short: what is whole, no more."""

from __future__ import annotations

import json
import math
import sqlite3
import struct
from bisect import bisect_left
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from instrument.errors import ConfigurationError
from instrument.tape.entry import Decoder, Entry, Kind, TapeError
from instrument.tape.measured import Measured
from instrument.tape.schema import (
    ASKED,
    KINDS,
    TABLES,
    How,
    checksum,
    sample_checksum,
    select_from,
)

ROWS_AT_ONCE = 1000
_BOOLS = [i for i, kind in enumerate(KINDS.values()) if kind is bool]
LATEST_S = 1e11  #: three thousand years after the machine was switched on
MISSING = "nothing was recorded, or it was copied without what lay beside it as -wal"


class Ending(NamedTuple):
    """How a recording ended."""

    t_s: float
    how: str  #: a `How`
    why: str
    samples: int  #: how many were recorded

    @property
    def asked(self) -> bool:
        """Whether somebody wanted the end, of the recording or of the instrument."""
        return self.how == How.STOPPED or (self.how, self.why) == (How.END, ASKED)


class Recording:
    """A recording, open for reading: what of it was there at that moment.

    Its iterators end at the last whole row; `damage` says what was found there.
    """

    def __init__(self, path: Path, db: sqlite3.Connection) -> None:
        """Raises ConfigurationError where nothing of a recording can be read."""
        self.path = path
        self.damage = ""
        self._db = db
        self._last = self._last_numbers()
        self.about: Mapping[str, Any] = {}  #: what BEGIN said, and when: `begin_s`
        try:
            self.about = {key: json.loads(value) for key, value in self._rows("about")}
            self.begin_s = float(self.about["begin_s"])
        except (KeyError, TypeError, ValueError, RecursionError):
            raise ConfigurationError(f"{path} holds no recording ({self.damage or MISSING})") from None
        if not 0 <= self.begin_s <= LATEST_S:
            raise ConfigurationError(f"{path} is no recording: it begins at {self.begin_s:g} s")
        if self.ending and self.ending.samples != self._last["samples"] is not None:
            self.damage = f"it has {self._last['samples']} of {self.ending.samples} samples"

    # ---- what it holds; times of the samples are the host's monotonic clock, as recorded

    @property
    def checkpoint(self) -> Entry | None:
        """State of the coupling at the beginning; None where it is not whole."""
        for t_s, state in self._rows("checkpoint"):
            return Entry(Kind.CHECKPOINT, t_s, state)
        return None

    @property
    def ending(self) -> Ending | None:
        """How it ended; None where the recorder was killed, or still writes."""
        for row in self._rows("ending"):
            return Ending(*row)
        return None

    def entries(self) -> Iterator[Entry]:
        """All inputs, in order."""
        for _, batch in self._rows("tape"):
            try:
                yield from Decoder().feed(batch)
            except (TapeError, TypeError) as error:  # whole, and yet not ours
                self.damage = str(error)
                return

    def samples(self, from_s: float = -math.inf, to_s: float = math.inf) -> Iterator[Measured]:
        """The samples between these times since the beginning, in order."""
        low_s, high_s = self.begin_s + from_s, self.begin_s + to_s
        first = 1 if from_s == -math.inf else self._first_sample(low_s)
        for row in self._rows("samples", first, sample_checksum):
            values = [math.nan if value is None else value for value in row]
            for i in _BOOLS:
                values[i] = bool(values[i])
            sample = Measured._make(values)
            if not abs(sample.t_s) <= LATEST_S:
                self.damage = f"sample {sample.sequence} has no time"
                return
            if sample.t_s > high_s:
                return
            if sample.t_s >= low_s:
                yield sample

    def events(self) -> Iterator[Mapping[str, Any]]:
        """The records of the event log that were made meanwhile, in order."""
        for t_s, _, body in self._rows("events"):
            try:
                yield dict(json.loads(body))
            except (TypeError, ValueError, RecursionError) as error:  # whole, and yet not ours
                self.damage = f"the event at {t_s} s is none: {error}"
                return

    @property
    def simulated(self) -> bool:
        """Whether no real rig was recorded: known at the beginning, or since a board has greeted."""
        boards = (record.get("is") for record in self.events() if record.get("kind") == "board")
        return bool(self.about.get("simulated")) or not str(next(boards, "real")).startswith("real")

    # ---- how much of it there is

    @property
    def most_samples(self) -> int | None:
        """How many samples were recorded; None where the file is too damaged to tell."""
        return self._last["samples"]

    @property
    def extent_s(self) -> float:
        """Time from the beginning to the last sample [s]; NaN where that cannot be read."""
        return self._time_of(self.most_samples or 0) - self.begin_s

    def remark(self) -> str:
        """What is wrong with it, as far as it was read; empty where it is whole and its end was asked for."""
        if self.damage:
            return f"{self.path} is damaged: {self.damage}; another copy may have more"
        ending = self.ending
        if ending is not None and ending.asked:
            return ""
        why = "has no end (it is still written, or its recorder was killed)"
        if ending is not None:
            why = f"ends unasked ({ending.how}: {ending.why})"
        return f"{self.path} {why}: {self.extent_s:.1f} s, {self.most_samples} samples are whole"

    # ---- rows

    def _rows(
        self, table: str, first: int = 1, reckon: Callable[[Sequence[Any]], int] = checksum
    ) -> Iterator[tuple[Any, ...]]:
        """Rows of a table, without number and checksum, for as long as each is whole and follows another."""
        last, why = self._last[table], ""
        while last is None or first <= last:
            rows, why = self._read(table, first, ROWS_AT_ONCE if last is None else last + 1 - first)
            for row in rows:
                if row[0] != first or not _whole(row, reckon):
                    why = f"row {first} is not as it was written"
                    break
                yield row[1:-1]
                first += 1
            if why or not rows:
                self._note_damage(table, first - 1, why or f"row {first} is missing")
                return

    def _read(self, table: str, first: int, most: int) -> tuple[list[tuple[Any, ...]], str]:
        """Rows from a number on, and why there are no more of them."""
        rows: list[tuple[Any, ...]] = []
        try:
            rows.extend(self._db.execute(select_from(table), (first, min(most, ROWS_AT_ONCE))))
        except sqlite3.Error as error:
            return rows, str(error)
        return rows, ""

    def _note_damage(self, table: str, good: int, why: str) -> None:
        until = f", up to {self._time_of(good) - self.begin_s:.1f} s," if table == "samples" and good else ""
        self.damage = f"{good} rows of {table}{until} are whole ({why})"

    def _last_numbers(self) -> dict[str, int | None]:
        """Of all tables at one moment."""
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
            self.damage = f"the last of {table} cannot be read ({error})"
            return None

    def _time_of(self, number: int) -> float:
        """When a sample was taken [s]; NaN where that cannot be read."""
        with suppress(sqlite3.Error):
            row = self._db.execute("SELECT t_s FROM samples WHERE number = ?", (number,)).fetchone()
            if row and isinstance(row[0], float) and abs(row[0]) <= LATEST_S:
                return row[0]
        return math.nan

    def _first_sample(self, low_s: float) -> int:
        """Number of the first sample that is not before a time."""
        return 1 + bisect_left(range(1, 1 + (self.most_samples or 0)), low_s, key=self._time_of)


def _whole(row: tuple[Any, ...], reckon: Callable[[Sequence[Any]], int]) -> bool:
    try:
        return bool(reckon(row[:-1]) == row[-1])
    except (TypeError, ValueError, OverflowError, struct.error):
        return False
