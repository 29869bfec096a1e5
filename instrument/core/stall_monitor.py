"""Stall monitor: detects that the host process did not run for a while, because the computer was busy.

During a stall, bytes of the board and requests of the peers wait in the buffers of the operating system. The
silence of the board and of the peers is therefore measured only while the host runs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from pneuforce.protocol.limits import HOST_SILENCE_S

MAX_GAP_S = 0.1  #: the loop ticks every 10 ms; a longer gap is a stall


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
