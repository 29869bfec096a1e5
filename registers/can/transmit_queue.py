"""The outbox: frames on their way from the caller's thread to the one that sends them."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import suppress
from queue import Empty, SimpleQueue

from registers.can.wire import CanFrame

MOST_FRAMES = 256
FRESH_S = 0.1  #: a frame that has waited for longer is dropped: late force is wrong force


class Outbox:
    """Bounded and never waiting on the way in: the oldest frame makes room. What is dropped is counted."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self.dropped = 0
        self._clock = clock
        self._queue: SimpleQueue[tuple[float, CanFrame] | None] = SimpleQueue()
        self._lock = threading.Lock()

    def put(self, frame: CanFrame) -> None:
        """Add a frame; to be called from one thread."""
        if self._queue.qsize() >= MOST_FRAMES:
            with suppress(Empty):
                self._queue.get_nowait()
                self.drop()
        self._queue.put((self._clock(), frame))

    def take(self) -> CanFrame | None:
        """The next frame that is still fresh, waited for; None where the outbox was closed."""
        while (item := self._queue.get()) is not None:
            put_s, frame = item
            if self._clock() - put_s <= FRESH_S:
                return frame
            self.drop()
        return None

    def drop(self) -> None:
        """Count one frame that was not sent; any thread may."""
        with self._lock:
            self.dropped += 1

    def close(self) -> None:
        """End `take` once it has handed out what waits."""
        self._queue.put(None)
