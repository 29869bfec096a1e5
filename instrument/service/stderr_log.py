"""Log of the process on stderr, written by a thread, so that a slow reader never delays a sample."""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from logging.handlers import QueueHandler
from queue import Full, Queue
from threading import Thread

from pneuforce.instrument.core.state import STATE_LOGGER
from pneuforce.support.counted import counted
from pneuforce.support.printable import printable
from pneuforce.support.throttle import TokenBucket

FLUSH_S = 0.2
STDERR = 2


@dataclass(frozen=True, slots=True)
class LogLimit:
    """Limit for the lines of one kind."""

    per_s: float  #: lines per second, and lines at once
    max_waiting: int  #: a line is dropped if this number of lines waits for the writing thread


#: Each kind of line has its own limit, so that no kind can displace a more important kind. Together the
#: limits stay below the limit of journald, which is 10 000 lines in 30 s for each service.
INFORMATION = LogLimit(20, 500)  #: for example writes. A peer can write 1000 times per second
WARNINGS = LogLimit(
    50, 750
)  #: warnings and errors. The buses limit the warnings of their peers to 5 per second
STATE = LogLimit(
    100, 1000
)  #: trips, state changes and the end. A peer can cause fewer than 10 lines per second


def limit_of(record: logging.LogRecord) -> LogLimit:
    """Return the limit that applies to a log record."""
    if record.name == STATE_LOGGER:
        return STATE
    return WARNINGS if record.levelno >= logging.WARNING else INFORMATION


@dataclass(slots=True)
class _LineCounter:
    """Token bucket and dropped lines of one kind of line."""

    bucket: TokenBucket
    dropped: int = 0


class _MessageFormatter(logging.Formatter):
    """Formatter that escapes control characters and line breaks in a message, but not in a traceback."""

    def formatMessage(self, record: logging.LogRecord) -> str:  # noqa: N802 (name in the base class)
        """Return the message as one printable line."""
        return printable(super().formatMessage(record))


class LogQueue(QueueHandler):
    """Queue of log records for the writing thread. Records beyond the limits are dropped and counted."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._waiting: Queue[logging.LogRecord | None] = Queue(STATE.max_waiting)
        super().__init__(self._waiting)
        self.setFormatter(_MessageFormatter("%(message)s"))
        self._clock = clock
        self._counters = {
            limit: _LineCounter(TokenBucket(limit.per_s, limit.per_s))
            for limit in (INFORMATION, WARNINGS, STATE)
        }

    def enqueue(self, record: logging.LogRecord) -> None:
        """Queue a record, or drop it. Never waits."""
        limit = limit_of(record)
        counter = self._counters[limit]
        if self._waiting.qsize() >= limit.max_waiting or not counter.bucket.take(self._clock()):
            counter.dropped += 1
            return
        if counter.dropped:
            record.msg, counter.dropped = (
                f"{record.msg} ({counted(counter.dropped, 'line')} dropped before)",
                0,
            )
        with suppress(Full):  # at the end of the process, the last entry is not a record
            self._waiting.put_nowait(record)


@contextmanager
def log_to_stderr() -> Iterator[None]:
    """Write the log of this process to stderr, from a separate thread.

    The thread writes directly to the file descriptor. A blocked write through `logging` or `sys.stderr`
    would hold a lock, and the process could not end.
    """
    log_queue, formatter = LogQueue(), logging.Formatter("%(asctime)s %(message)s", datefmt="%H:%M:%S")
    logging.basicConfig(level=logging.INFO, handlers=[log_queue])

    def write() -> None:
        while (record := log_queue.queue.get()) is not None:
            line = printable(formatter.format(record), keep="\n")  # a file name may be invalid Unicode
            with suppress(OSError):
                os.write(STDERR, f"{line}\n".encode())

    thread = Thread(target=write, name="log", daemon=True)
    thread.start()
    try:
        yield
    finally:
        with suppress(Full):
            log_queue.queue.put_nowait(None)
        thread.join(FLUSH_S)
