"""Detection of received data that waited in a buffer, because the receiving thread did not run.

A debugger, a frozen container or a busy computer stops a program for seconds. The buffers of the system then
contain data that was sent at that time, and that arrives all at once when the program continues.
"""

from __future__ import annotations

import math

RECEIVE_TIMEOUT_S = 0.1  #: longest wait for data
MAX_GAP_S = 0.15  #: time between the ends of two waits, above which the thread did not run in time
#: Time between two moments at which nothing waits, after which no old data follows. A sender that was blocked
#: by a full buffer sends the rest within this time.
SETTLED_S = 0.05
PAUSE_S = 0.002  #: pause after an empty reception while old data can follow


class Backlog:
    """State of a receiving loop: whether its data is current, or possibly waited in a buffer."""

    def __init__(self) -> None:
        self.possible = False  #: the data that is received now possibly waited
        self._last_s = math.inf
        self._empty_s = math.inf

    @property
    def timeout_s(self) -> float:
        """Return the timeout of the next reception [s]: 0 shows whether something waits."""
        return 0.0 if self.possible else RECEIVE_TIMEOUT_S

    def add(self, now_s: float, *, arrived: bool) -> float:
        """Add the end of a reception, at the time `now_s`. Return the pause before the next reception [s]."""
        if now_s - self._last_s > MAX_GAP_S:
            self.possible, self._empty_s = True, math.inf
        self._last_s = now_s
        if arrived or not self.possible:
            return 0.0
        self._empty_s = min(self._empty_s, now_s)
        self.possible = now_s < self._empty_s + SETTLED_S
        return PAUSE_S if self.possible else 0.0
