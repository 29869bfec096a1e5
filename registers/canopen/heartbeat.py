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
    """Monitor for the heartbeat of the master. Monitoring starts with the first heartbeat received.

    A reset of the node changes the master to be monitored next, but never ends a monitoring that has started.
    """

    def __init__(self) -> None:
        self.lost = False
        self._configured = self._running = (0, 0.0)  # node id and heartbeat time [s] of a master
        self._deadline_s = math.inf

    @property
    def node_ids(self) -> frozenset[int]:
        """Return the node ids whose heartbeats count."""
        return frozenset((self._configured[0], self._running[0])) - {0}

    def configure(self, consumer_heartbeat: int) -> None:
        """End the monitoring, and wait for the first heartbeat of the master in a value of 1016h:1."""
        self.lost = False
        self._configured, self._running = _master(consumer_heartbeat), (0, 0.0)
        self._deadline_s = math.inf

    def reset(self, consumer_heartbeat: int) -> None:
        """Wait for the master in a value of 1016h:1, but continue a monitoring until this master is there."""
        self._configured = _master(consumer_heartbeat)

    def received(self, node_id: int, now_s: float) -> None:
        """Record a heartbeat of a node of `node_ids`. The next one must arrive within its heartbeat time."""
        self.lost = False
        if node_id == self._configured[0]:
            self._running = self._configured
        self._deadline_s = now_s + self._running[1]

    def timed_out(self, now_s: float) -> bool:
        """Return True once when the heartbeat is overdue, and set `lost`."""
        if now_s <= self._deadline_s:
            return False
        self.lost = True
        self._deadline_s = math.inf
        return True


def _master(consumer_heartbeat: int) -> tuple[int, float]:
    """Return node id and heartbeat time [s] of the master in a value of 1016h:1; (0, 0.0) if disabled."""
    node_id, time_ms = consumer_heartbeat >> 16 & 0x7F, consumer_heartbeat & 0xFFFF
    return (node_id, time_ms / 1e3) if node_id and time_ms else (0, 0.0)
