"""Queue of frames to send, from the caller's thread to the sending thread."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import suppress
from enum import Enum
from queue import Empty, SimpleQueue

from pneuforce.registers.can.wire import CanFrame

MAX_FRAMES = 256
MAX_AGE_S = 0.1  #: an older frame is dropped, because its force is outdated


class DropCause(Enum):
    """Reason why a frame was not sent, as far as this computer knows the reason."""

    BUS_DOWN = "CAN is down"
    NOT_ACCEPTED = (
        "the controller accepted no frame for 0.1 s: no other node acknowledges (cable, terminator, "
        "bit rate, node off), or the bus is overloaded"
    )
    OUTDATED = "waited longer than 0.1 s: the controller was blocked, or this computer is overloaded"


class TransmitQueue:
    """Bounded queue whose `put` never blocks: a full queue drops and counts its oldest frame."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self.drops = dict.fromkeys(DropCause, 0)
        self._clock = clock
        self._queue: SimpleQueue[tuple[float, CanFrame] | None] = SimpleQueue()
        self._lock = threading.Lock()

    @property
    def dropped(self) -> int:
        """Return the number of frames that were not sent, for all causes."""
        return sum(self.drops.values())

    def put(self, frame: CanFrame, made_s: float | None = None) -> None:
        """Add a frame. `made_s` is the time of its values; None means now. Only one thread may call this.

        A stall of this process between `made_s` and this call makes the frame old: `get` drops it.
        """
        if self._queue.qsize() >= MAX_FRAMES:
            with suppress(Empty):
                self._queue.get_nowait()
                self.count_dropped(DropCause.OUTDATED)
        self._queue.put((self._clock() if made_s is None else made_s, frame))

    def get(self) -> CanFrame | None:
        """Wait for a frame that is at most 0.1 s old and return it; return None after `close`."""
        while (item := self._queue.get()) is not None:
            made_s, frame = item
            if self._clock() - made_s <= MAX_AGE_S:
                return frame
            self.count_dropped(DropCause.OUTDATED)
        return None

    def count_dropped(self, cause: DropCause) -> None:
        """Count one frame that was not sent. Any thread may call this method."""
        with self._lock:
            self.drops[cause] += 1

    def close(self) -> None:
        """Make `get` return None after the frames that are still in the queue."""
        self._queue.put(None)
