"""Writer of the event log. A thread writes the records, so that the caller never waits for the disk."""

from __future__ import annotations

import logging
import math
import time
from collections import deque
from pathlib import Path
from threading import Event, Thread

from pneuforce.instrument.audit.anchor import Anchor, format_anchor
from pneuforce.instrument.audit.event_throttle import EventCounter
from pneuforce.instrument.audit.record import AuditRecord, Timestamp, iso_utc, record_body
from pneuforce.instrument.audit.store import EventLogFile, EventLogFileError
from pneuforce.instrument.core.event_log_head import EventLogHead
from pneuforce.instrument.core.state import STATE_LOGGER
from pneuforce.support.counted import counted

log = logging.getLogger("pneuforce")
#: Logger for the anchors. A peer that causes many other lines cannot displace them.
state_log = logging.getLogger(STATE_LOGGER)

#: Records that arrive within this time are written in one commit. The thread polls, so that a caller does
#: not have to wake the thread.
GATHER_S = 0.1
RETRY_S = 1.0
#: Largest number of records in memory while the disk is not available. Minor records may fill half of it.
MAX_WAITING = 10_000
BATCH = 1000
CLOSE_S = 0.5
ANCHOR_INTERVAL_S = 3600.0  #: interval of the anchors, in addition to those after a start and at the end


class EventLogWriter:
    """Writer that appends records to a file, and keeps them in memory while the file cannot be written.

    `write_error` is the reason why the file cannot be written now, or an empty string. `head` is the head of
    the records on the disk. The thread of the writer replaces both, and any thread may read them. The
    constructor raises
    EventLogFileError if the file is not an event log or another instrument writes it. A full or missing disk
    does not prevent the start.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.write_error = ""
        self.head = EventLogHead()
        self._waiting: deque[AuditRecord] = deque()
        self._batch: list[bytes] = []  # bodies taken from `_waiting` that are not yet on the disk
        self._lost: EventCounter | None = None
        self._file: EventLogFile | None = None
        self._head: bytes | None = None  # digest of the last record in the file
        self._replaced = ""  # how the file was removed or replaced, until a record of the new file reports it
        # Digest of the last record if a commit failed but nevertheless has written its records.
        self._expected_head: bytes | None = None
        self._anchor_due_s = -math.inf  # time at which the next anchor is due
        self._anchored_head: bytes | None = None  # head in the last anchor
        self._end = Event()
        try:
            self._open()
        except EventLogFileError:
            raise
        except Exception as error:
            self._set_error(error)
        self._thread = Thread(target=self._run, name="events", daemon=True)
        self._thread.start()

    def append(self, record: AuditRecord) -> None:
        """Append a record. If too many records wait, drop it. A later record counts the lost records."""
        room = MAX_WAITING - len(self._waiting) - len(self._batch)
        if room < (MAX_WAITING // 2 if record.minor else 1):
            self._lost = self._lost or EventCounter("lost", record.at, record.fields)
            self._lost.add(record.at, record.fields.get("times", 1))
            return
        if self._lost is not None and room > 1:
            self._waiting.extend(AuditRecord(record.at, fields) for fields in self._lost.report())
            self._lost = None
        self._waiting.append(record)

    def close(self) -> None:
        """Write the remaining records, for at most half a second, and end the thread."""
        self._end.set()
        self._thread.join(CLOSE_S)

    # ---- the thread

    def _run(self) -> None:
        while not self._end.wait(RETRY_S if self.write_error else GATHER_S):
            self._try()
        self._try()  # writes the last records, for example `stop`, which were appended just before `close`
        unwritten = len(self._waiting) + len(self._batch)
        if unwritten:
            log.error("event log %s: %s could not be written", self.path, counted(unwritten, "record"))
        if self._file is not None:
            if self._file.head != self._anchored_head:
                self._log_anchor(self._file)
            self._file.close()

    def _try(self) -> None:
        try:
            if self._file is None:
                self._open()
            self._write()
        except Exception as error:  # an uncaught error would end this thread
            self._close_file()
            self._set_error(error)
        else:
            if self.write_error:
                self.write_error = ""
                log.info("event log %s can be written again", self.path)

    def _open(self) -> None:
        self._file = file = EventLogFile(self.path)
        if self._head is not None and file.head == self._expected_head:
            self._batch = []
        elif self._replaced or self._head not in (None, file.head):
            why = self._replaced or "the path now has another file"
            fields = {"kind": "file_changed", "why": why, "head_before": (self._head or b"").hex()}
            self._batch.insert(0, record_body(AuditRecord(_now(), fields)))
            self._anchor_due_s = -math.inf
        self._head, self._expected_head, self._replaced = file.head, None, ""
        self.head = EventLogHead(file.record_count, file.head)

    def _write(self) -> None:
        assert self._file is not None
        self._check_in_place(self._file)
        while self._batch or self._waiting:
            self._check_in_place(self._file)  # the file may be replaced during a batch
            self._fill_batch()
            self._expected_head = self._file.rows_of(self._batch)[-1][2]
            self._file.append(self._batch)
            self._batch, self._head, self._expected_head = [], self._file.head, None
            self.head = EventLogHead(self._file.record_count, self._file.head)
        if time.monotonic() >= self._anchor_due_s:
            self._log_anchor(self._file)

    def _log_anchor(self, file: EventLogFile) -> None:
        """Log the present head, so that a later cut or replacement of the file can be detected."""
        if file.record_count:
            anchor = Anchor(file.record_count, file.head.hex(), iso_utc(_now()))
            state_log.info("%s", format_anchor(anchor))
            self._anchor_due_s = time.monotonic() + ANCHOR_INTERVAL_S
            self._anchored_head = file.head

    def _check_in_place(self, file: EventLogFile) -> None:
        try:
            file.check_in_place()
        except OSError as error:
            self._replaced = _reason(error)
            raise

    def _fill_batch(self) -> None:
        """Move waiting records to the batch.

        Each record is added to the batch before it is removed from `_waiting`, because `append` counts the
        records of both at any time.
        """
        while len(self._batch) < BATCH and self._waiting:
            self._batch.append(record_body(self._waiting[0]))
            self._waiting.popleft()

    def _close_file(self) -> None:
        if self._file is not None:
            self._file.close()
            self._file = None

    def _set_error(self, error: Exception) -> None:
        """Set `write_error`. Log the first error, and each new error that a user has to correct."""
        why = _reason(error)
        if not self.write_error or (isinstance(error, EventLogFileError) and why != self.write_error):
            log.warning(
                "event log %s cannot be written: %s; measuring continues, and records are kept in memory: "
                "check the free space, the disk and the permissions",
                self.path,
                why,
            )
        self.write_error = why


def _now() -> Timestamp:
    return Timestamp(time.time_ns() // 1000, time.monotonic())


def _reason(error: Exception) -> str:
    return (error.strerror if isinstance(error, OSError) else None) or str(error) or type(error).__name__
