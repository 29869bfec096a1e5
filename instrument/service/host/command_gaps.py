"""Histogram of the gaps between two commands to the board."""

from __future__ import annotations

from bisect import bisect_left
from typing import Any

from pneuforce.protocol.limits import HOST_SILENCE_S

#: Upper bounds of the buckets [s]. The normal gap is 50 to 60 ms. After `HOST_SILENCE_S`, the board closes
#: the inlet. After 2 s (`host_timeout_s`), the board vents.
BOUNDS_S = (0.055, 0.06, 0.075, 0.1, 0.15, HOST_SILENCE_S, 0.5, 1.0, 2.0)


class CommandGaps:
    """Number of gaps in each bucket, and the sum of all gaps, since the start of the host process."""

    def __init__(self) -> None:
        self._counts = [0] * (len(BOUNDS_S) + 1)
        self._sum_s = 0.0
        self._sent_s: float | None = None

    def sent(self, now_s: float) -> None:
        """Count the gap before a command that was sent now."""
        if self._sent_s is not None:
            gap_s = now_s - self._sent_s
            self._counts[bisect_left(BOUNDS_S, gap_s)] += 1
            self._sum_s += gap_s
        self._sent_s = now_s

    def restart(self) -> None:
        """Do not count the time until the next command, because the board receives no commands now."""
        self._sent_s = None

    def values(self) -> dict[str, Any]:
        """Return JSON values: the bounds [s], the number of gaps in each bucket, and the sum [s].

        A gap belongs to the first bucket whose bound is not below the gap, or else to the last bucket.
        """
        return {"bounds_s": list(BOUNDS_S), "counts": list(self._counts), "sum_s": self._sum_s}
