"""The log on stderr: whoever reads it, or does not, never holds up a sample."""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from logging.handlers import QueueHandler
from queue import Full, Queue
from threading import Thread

MOST_WAITING = 1000
MOST_PER_S = 20
FLUSH_S = 0.2
STDERR = 2


class Postbox(QueueHandler):
    """Hands records to a thread; what is too much for it, or for a reader, is dropped and counted."""

    def __init__(self) -> None:
        super().__init__(Queue(MOST_WAITING))
        self.setFormatter(logging.Formatter("%(message)s"))
        self._second = 0
        self._in_second = 0
        self._held_back = 0

    def enqueue(self, record: logging.LogRecord) -> None:
        """Take a record, or drop it; never waits."""
        second = int(time.monotonic())
        if second != self._second:
            self._second, self._in_second = second, 0
        self._in_second += 1
        if self._in_second > MOST_PER_S:
            self._held_back += 1
            return
        if self._held_back:
            record.msg, self._held_back = f"{record.msg} ({self._held_back} lines held back before)", 0
        try:
            self.queue.put_nowait(record)
        except Full:
            self._held_back += 1


@contextmanager
def log_to_stderr() -> Iterator[None]:
    """Send the log of this process to stderr, from a thread of its own.

    The thread writes to the descriptor itself: a lock of `logging` or `sys.stderr` held by a write that
    blocks would keep the process from ending.
    """
    box, form = Postbox(), logging.Formatter("%(asctime)s %(message)s", datefmt="%H:%M:%S")
    logging.basicConfig(level=logging.INFO, handlers=[box])

    def write() -> None:
        while (record := box.queue.get()) is not None:
            with suppress(OSError):
                os.write(STDERR, f"{form.format(record)}\n".encode())

    thread = Thread(target=write, name="log", daemon=True)
    thread.start()
    try:
        yield
    finally:
        with suppress(Full):
            box.queue.put_nowait(None)
        thread.join(FLUSH_S)
