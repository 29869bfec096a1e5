"""Exponential back-off between attempts to open a failed connection."""

from __future__ import annotations

import math
from dataclasses import dataclass, field


@dataclass(slots=True)
class Backoff:
    """Waiting time that doubles with each attempt and is reset after a stable connection."""

    first_s: float
    max_s: float
    stable_s: float  #: duration after which a connection counts as stable
    wait_s: float = field(init=False)
    _opened_s: float = -math.inf

    def __post_init__(self) -> None:
        self.wait_s = self.first_s

    def attempted(self) -> None:
        """Double the waiting time after an attempt, up to its maximum."""
        self.wait_s = min(2 * self.wait_s, self.max_s)

    def opened(self, now_s: float) -> None:
        """Store the time of a successful attempt."""
        self._opened_s = now_s

    def failed(self, now_s: float) -> bool:
        """Reset the waiting time if the failed connection was stable. Return True if it was stable."""
        if stable := now_s - self._opened_s > self.stable_s:
            self.reset()
        return stable

    def reset(self) -> None:
        """Return to the first waiting time."""
        self.wait_s = self.first_s
