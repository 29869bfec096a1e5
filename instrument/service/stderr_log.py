"""Log of the process on stderr, written by a thread, so that a slow reader never delays a sample."""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from logging.handlers import QueueHandler
from queue import Full, Queue
from threading import Thread

MAX_WAITING = 1000
MAX_PER_S = 20
FLUSH_S = 0.2
STDERR = 2


class LogQueue(QueueHandler):
    """Queue of log records for the writing thread. Records beyond the limits are dropped and counted."""

    def __init__(self) -> None:
        super().__init__(Queue(MAX_WAITING))
        self.setFormatter(logging.Formatter("%(message)s"))
        self._second = 0
        self._in_second = 0
        self._dropped = 0

    def enqueue(self, record: logging.LogRecord) -> None:
        """Queue a record, or drop it. Never waits."""
        second = int(time.monotonic())
        if second != self._second:
            self._second, self._in_second = second, 0
        self._in_second += 1
        if self._in_second > MAX_PER_S:
            self._dropped += 1
            return
        if self._dropped:
            record.msg, self._dropped = f"{record.msg} ({self._dropped} lines dropped before)", 0
        try:
            self.queue.put_nowait(record)
        except Full:
            self._dropped += 1


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
            with suppress(OSError):
                os.write(STDERR, f"{formatter.format(record)}\n".encode())

    thread = Thread(target=write, name="log", daemon=True)
    thread.start()
    try:
        yield
    finally:
        with suppress(Full):
            log_queue.queue.put_nowait(None)
        thread.join(FLUSH_S)
