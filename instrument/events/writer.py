"""The writer: a thread that takes records and puts them on the disk; whoever hands them over never waits."""

from __future__ import annotations

import logging
import time
from collections import deque
from pathlib import Path
from threading import Event, Thread

from instrument.events.record import Moment, Record, body_of
from instrument.events.sieve import Tally
from instrument.events.store import NotOurs, Store

log = logging.getLogger("pneuforce")

GATHER_S = 0.1  #: what comes within this time shares a commit; nobody has to wake the writer
TRY_AGAIN_S = 1.0
MOST_WAITING = 10_000  #: records kept while the disk does not take them; minor ones only up to half of it
BATCH = 1000
CLOSE_S = 0.5


class Writer:
    """Appends records to a file for as long as it can be written, and keeps them while it cannot.

    `trouble` is why it cannot now, empty where it can. Raises NotOurs where the file is not an event log or
    another instrument writes it; a disk that is full or away is no reason not to start.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.trouble = ""
        self._waiting: deque[Record] = deque()
        self._batch: list[bytes] = []  # taken from those waiting, not yet on the disk
        self._lost: Tally | None = None
        self._store: Store | None = None
        self._head: bytes | None = None  # of the file as it was last seen
        self._displaced = ""  # which of its files was taken away, until a record says so
        self._promised: bytes | None = None  # its head if a commit that failed was carried out after all
        self._end = Event()
        try:
            self._open()
        except NotOurs:
            raise
        except Exception as error:
            self._say_trouble(error)
        self._thread = Thread(target=self._run, name="events", daemon=True)
        self._thread.start()

    def put(self, record: Record) -> None:
        """Take a record; where too many wait it is lost, and how many were lost is a record too."""
        room = MOST_WAITING - len(self._waiting) - len(self._batch)
        if room < (MOST_WAITING // 2 if record.minor else 1):
            self._lost = self._lost or Tally("lost", record.at, record.facts)
            self._lost.add(record.at, record.facts.get("times", 1))
            return
        if self._lost is not None and room > 1:
            self._waiting.extend(Record(record.at, facts) for facts in self._lost.told())
            self._lost = None
        self._waiting.append(record)

    def close(self) -> None:
        """Write what is left, as far as the disk takes it within half a second, and end."""
        self._end.set()
        self._thread.join(CLOSE_S)

    # ---- the thread

    def _run(self) -> None:
        while not self._end.wait(TRY_AGAIN_S if self.trouble else GATHER_S):
            self._try()
        self._try()  # what was put before the end was set: `stop` among it
        unwritten = len(self._waiting) + len(self._batch)
        if unwritten:
            log.error("event log %s: %d records could not be written", self.path, unwritten)
        if self._store is not None:
            self._store.close()

    def _try(self) -> None:
        try:
            if self._store is None:
                self._open()
            self._write()
        except Exception as error:  # whatever it is, it must not end this thread unseen
            self._give_back()
            self._say_trouble(error)
        else:
            if self.trouble:
                self.trouble = ""
                log.info("event log %s is written again", self.path)

    def _open(self) -> None:
        self._store = store = Store(self.path)
        if self._head is not None and store.head == self._promised:
            self._batch = []
        elif self._displaced or self._head not in (None, store.head):
            why = self._displaced or "another file was found under its name"
            facts = {"kind": "file_changed", "why": why, "head_before": (self._head or b"").hex()}
            self._batch.insert(0, body_of(Record(_now(), facts)))
        self._head, self._promised, self._displaced = store.head, None, ""

    def _write(self) -> None:
        assert self._store is not None
        self._check_in_place(self._store)
        while self._batch or self._waiting:
            self._check_in_place(self._store)  # again each time: a record may have come since
            self._take()
            self._promised = self._store.sealed(self._batch)[-1][2]
            self._store.append(self._batch)
            self._batch, self._head, self._promised = [], self._store.head, None

    def _check_in_place(self, store: Store) -> None:
        try:
            store.check_in_place()
        except OSError as error:
            self._displaced = _why(error)
            raise

    def _take(self) -> None:
        """Fill the batch. A record is never in neither place, or more than may wait would be let in."""
        while len(self._batch) < BATCH and self._waiting:
            self._batch.append(body_of(self._waiting[0]))
            self._waiting.popleft()

    def _give_back(self) -> None:
        if self._store is not None:
            self._store.close()
            self._store = None

    def _say_trouble(self, error: Exception) -> None:
        """Once, and once more where somebody has to do something about it."""
        why = _why(error)
        if not self.trouble or (isinstance(error, NotOurs) and why != self.trouble):
            log.warning(
                "event log %s cannot be written: %s; measuring goes on, records are kept in memory meanwhile",
                self.path,
                why,
            )
        self.trouble = why


def _now() -> Moment:
    return Moment(time.time_ns() // 1000, time.monotonic())


def _why(error: Exception) -> str:
    return (error.strerror if isinstance(error, OSError) else None) or str(error) or type(error).__name__
