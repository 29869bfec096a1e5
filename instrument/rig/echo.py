"""What a sample's echo says of its age: the board had not heard yet of commands that it does not know."""

from __future__ import annotations

import math
from collections import deque

#: From sending a command to a sample that knows of it, at the board: a pass of its loop, and USB's time.
WAY_UP_S = 0.02
_MOST_UNHEARD = 128  #: the echo is a sequence's low byte


class CommandEcho:
    """Commands sent and not yet known to a sample. A line that delays all bytes cannot hide it from this."""

    def __init__(self) -> None:
        self._unheard: deque[tuple[int, float]] = deque(maxlen=_MOST_UNHEARD)

    def sent(self, sequence: int, now_s: float) -> None:
        """A command goes to the board."""
        self._unheard.append((sequence & 0xFF, now_s))

    def latest_s(self, echo: int) -> float:
        """Latest time [s] at which a sample with this echo can have been taken; inf where nothing tells."""
        if any(sequence == echo for sequence, _ in self._unheard):
            while self._unheard.popleft()[0] != echo:
                pass
        return self._unheard[0][1] + WAY_UP_S if self._unheard else math.inf
