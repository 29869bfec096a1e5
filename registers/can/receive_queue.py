"""Queue of received frames, from the bus thread to the thread that carries out commands."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable

from pneuforce.registers.can.wire import CanFrame

MAX_FRAMES = 32


class ReceiveQueue:
    """Bounded queue, so that a flood of frames does not delay the samples.

    A vent command is accepted even if the queue is full: it replaces the newest frame.
    """

    def __init__(self, is_vent: Callable[[CanFrame], bool]) -> None:
        self.dropped = 0
        self._is_vent = is_vent
        self._frames: deque[CanFrame] = deque()
        self._lock = threading.Lock()

    def put(self, frame: CanFrame) -> bool:
        """Add a frame; return True if the number of frames in the queue has grown.

        Returns False if the queue is full. A vent then replaces the newest frame; any other frame is dropped.
        """
        with self._lock:
            if len(self._frames) < MAX_FRAMES:
                self._frames.append(frame)
                return True
            self.dropped += 1
            if self._is_vent(frame):
                self._frames[-1] = frame
            return False

    def get(self) -> CanFrame:
        """Return the oldest frame. Call this method once for each `put` that returned True."""
        with self._lock:
            return self._frames.popleft()
