"""Heartbeats (CiA 301, 7.2.8.3.2.2): our own, and the watch over the master's."""

from __future__ import annotations

import math


class Producer:
    """When the next heartbeat is due."""

    def __init__(self) -> None:
        self._next_s = math.inf

    def begin(self, now_s: float, period_s: float) -> None:
        """Start anew: the first comes after one period; none with a period of 0."""
        self._next_s = now_s + period_s if period_s else math.inf

    def due(self, now_s: float, period_s: float) -> bool:
        """Whether to send one now."""
        if now_s < self._next_s:
            return False
        late = now_s - self._next_s > period_s
        self._next_s = now_s + period_s if late else self._next_s + period_s
        return True


class Consumer:
    """The watch over one node; it begins with the first heartbeat that is heard."""

    def __init__(self) -> None:
        self.lost = False
        self._until_s = math.inf

    def begin(self) -> None:
        """Watch anew, over whomever."""
        self.lost = False
        self._until_s = math.inf

    def heard(self, now_s: float, time_s: float) -> None:
        """Take note of a heartbeat; the next must come within `time_s`."""
        self.lost = False
        self._until_s = now_s + time_s

    def ran_out(self, now_s: float) -> bool:
        """Whether the master has just been lost: true once."""
        if now_s <= self._until_s:
            return False
        self.lost = True
        self._until_s = math.inf
        return True


def watched(master: int) -> tuple[int, float]:
    """Node id and time [s] of object 1016h:1; (0, 0.0) where nobody is watched."""
    node_id, time_ms = master >> 16 & 0x7F, master & 0xFFFF
    return (node_id, time_ms / 1e3) if node_id and time_ms else (0, 0.0)
