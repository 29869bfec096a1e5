"""Log line with the error counters of a bus, at most once a minute."""

from __future__ import annotations

import math
from collections.abc import Mapping

PERIOD_S = 60.0


class CounterLogger:
    """Writer of log lines about counters: the first increase at once, later increases once a minute."""

    def __init__(self) -> None:
        self._reported: Mapping[str, int] = {}
        self._next_s = -math.inf

    def line(self, counts: Mapping[str, int], now_s: float) -> str:
        """Return the increases since the last line, each with its name in `counts`.

        Returns "" if no counter has increased, or if the last line is less than a minute old.
        """
        if now_s < self._next_s or counts == self._reported:
            return ""
        increases = {name: count - self._reported.get(name, 0) for name, count in counts.items()}
        self._reported = counts
        line = ", ".join(f"{name} {increase}" for name, increase in increases.items() if increase)
        if line:
            self._next_s = now_s + PERIOD_S
        return line
