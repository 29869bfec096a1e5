"""Stall monitor: detects that the host process did not run for a while, because the computer was busy.

During a stall, bytes of the board and requests of the peers wait in the buffers of the operating system. The
silence of the board and of the peers is therefore measured only while the host runs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from pneuforce.protocol.limits import HOST_SILENCE_S

MAX_GAP_S = 0.1  #: the loop ticks every 10 ms; a longer gap is a stall
REPORT_PERIOD_S = 60.0  #: shortest time between two sentences for the log about short stalls
LONG_S = 1.0  #: a longer stall is logged at once


@dataclass(slots=True)
class StallMonitor:
    """Detector for gaps in the activity of the host."""

    _stall_s: float = 0.0  # duration of the latest stall
    _resumed_s: float = -math.inf
    _active_s: float = math.inf

    def update(self, now_s: float) -> float:
        """Record that the host runs now. Return the duration [s] of the stall that ends now, or 0."""
        gap_s = now_s - self._active_s
        self._active_s = now_s
        if gap_s <= MAX_GAP_S:
            return 0.0
        self._stall_s, self._resumed_s = gap_s, now_s
        return gap_s

    def buffered_s(self, now_s: float) -> float:
        """Return the longest time [s] that bytes can have waited in a buffer before they are read now.

        The result is the duration of the latest stall until 0.25 s after its end, then 0.
        """
        return self._stall_s if now_s - self._resumed_s <= HOST_SILENCE_S else 0.0

    def active_s(self, since_s: float, now_s: float) -> float:
        """Return the time from `since_s` until now [s], without the latest stall."""
        return now_s - since_s - (self._stall_s if self._resumed_s > since_s else 0.0)


@dataclass(slots=True)
class StallReport:
    """Sentences for the log about stalls: the first and each long one at once, the others once per minute."""

    _count: int = 0  # stalls since the last sentence
    _longest_s: float = 0.0
    _due_s: float = -math.inf

    def update(self, stall_s: float, now_s: float) -> str:
        """Count a stall [s] that ends now, 0 for none. Return a sentence if one is due, otherwise ""."""
        self._count += stall_s > 0
        self._longest_s = max(self._longest_s, stall_s)
        if not self._count or (now_s < self._due_s and stall_s <= LONG_S):
            return ""
        times = f", {self._count} times, at most" if self._count > 1 else ""
        cause = "the computer was overloaded or suspended, or the process was stopped"
        sentence = f"this process did not run{times} for {self._longest_s:.2f} s: {cause}"
        self._count, self._longest_s, self._due_s = 0, 0.0, now_s + REPORT_PERIOD_S
        return sentence
