"""Heartbeat (CiA 301, 7.2.8.3.2.2): producer of this node, and consumer of the master's heartbeat."""

from __future__ import annotations

import math


class HeartbeatProducer:
    """Timer for the heartbeat of this node."""

    def __init__(self) -> None:
        self._next_s = math.inf

    def start(self, now_s: float, period_s: float) -> None:
        """Restart the timer: the first heartbeat is due after one period.

        A period of 0 disables the heartbeat.
        """
        self._next_s = now_s + period_s if period_s else math.inf

    def due(self, now_s: float, period_s: float) -> bool:
        """Return True if a heartbeat must be sent now."""
        if now_s < self._next_s:
            return False
        late = now_s - self._next_s > period_s
        self._next_s = now_s + period_s if late else self._next_s + period_s
        return True


class HeartbeatConsumer:
    """Monitor for the heartbeat of the master. Monitoring starts with the first heartbeat received."""

    def __init__(self) -> None:
        self.lost = False
        self._deadline_s = math.inf

    def restart(self) -> None:
        """Wait again for the first heartbeat, for example after the consumer heartbeat time was written."""
        self.lost = False
        self._deadline_s = math.inf

    def received(self, now_s: float, timeout_s: float) -> None:
        """Record a heartbeat. The next heartbeat must arrive within `timeout_s`."""
        self.lost = False
        self._deadline_s = now_s + timeout_s

    def timed_out(self, now_s: float) -> bool:
        """Return True once when the heartbeat is overdue, and set `lost`."""
        if now_s <= self._deadline_s:
            return False
        self.lost = True
        self._deadline_s = math.inf
        return True


def monitored_node(consumer_heartbeat: int) -> tuple[int, float]:
    """Return the node id of the monitored master and the heartbeat time [s] from a value of object 1016h:1.

    Returns (0, 0.0) if monitoring is disabled.
    """
    node_id, time_ms = consumer_heartbeat >> 16 & 0x7F, consumer_heartbeat & 0xFFFF
    return (node_id, time_ms / 1e3) if node_id and time_ms else (0, 0.0)
