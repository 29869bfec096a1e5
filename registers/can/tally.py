"""What goes wrong on a bus, told in a line now and then: counters that nobody polls are seen by nobody."""

from __future__ import annotations

import math
from collections.abc import Mapping

PERIOD_S = 60.0


class Tally:
    """Tells what has been counted: the first of it at once, the rest once a minute."""

    def __init__(self) -> None:
        self._told: Mapping[str, int] = {}
        self._next_s = -math.inf

    def line(self, counts: Mapping[str, int], now_s: float) -> str:
        """What has come since the last line, by the names of `counts`; empty where nothing, or not yet."""
        if now_s < self._next_s or counts == self._told:
            return ""
        came = {what: count - self._told.get(what, 0) for what, count in counts.items()}
        self._told = counts
        line = ", ".join(f"{what} {count}" for what, count in came.items() if count)
        if line:
            self._next_s = now_s + PERIOD_S
        return line
