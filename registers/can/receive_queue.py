"""The inbox: frames on their way from the bus's thread to the one that obeys them."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable

from registers.can.wire import CanFrame

MOST_FRAMES = 32


class Inbox:
    """Bounded, so that a flood never holds up a sample; what goes before everything else still gets in."""

    def __init__(self, is_vent: Callable[[CanFrame], bool]) -> None:
        self.dropped = 0
        self._is_vent = is_vent
        self._frames: deque[CanFrame] = deque()
        self._lock = threading.Lock()

    def put(self, frame: CanFrame) -> bool:
        """Add a frame. False where there is no room, or where a vent has taken the last one's place."""
        with self._lock:
            if len(self._frames) < MOST_FRAMES:
                self._frames.append(frame)
                return True
            self.dropped += 1
            if self._is_vent(frame):
                self._frames[-1] = frame
            return False

    def take(self) -> CanFrame:
        """The next frame; there is one for each `put` that was True."""
        with self._lock:
            return self._frames.popleft()
