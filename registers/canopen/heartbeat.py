"""Heartbeat (CiA 301, 7.2.8.3.2.2): producer of this node, and consumer of the master's heartbeat."""

from __future__ import annotations

import math

from pneuforce.registers.can.frames import HEARTBEAT
from pneuforce.registers.can.wire import CanFrame
from pneuforce.registers.source import Source

_BOOT_UP = b"\x00"


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

    def __init__(self, source: Source) -> None:
        """Create a monitor that informs `source` when the master is lost and when it has recovered."""
        self.lost = False
        self._source = source
        self._configured = self._running = (0, 0.0)  # node id and heartbeat time [s] of a master
        self._deadline_s = math.inf

    def accepts(self, can_id: int) -> bool:
        """Return True for the identifier of the heartbeat of a monitored master."""
        node_id = can_id - HEARTBEAT.base_id
        return node_id > 0 and node_id in (self._configured[0], self._running[0])

    def configure(self, consumer_heartbeat: int, now_s: float) -> None:
        """End the monitoring, and wait for the first heartbeat of the master in a value of 1016h:1."""
        self._recovered(now_s)
        self._configured, self._running = _master(consumer_heartbeat), (0, 0.0)
        self._deadline_s = math.inf

    def reset(self, consumer_heartbeat: int) -> None:
        """Wait for the master in a value of 1016h:1, but continue a monitoring until this master is there."""
        self._configured = _master(consumer_heartbeat)

    def received(self, frame: CanFrame, now_s: float) -> bool:
        """Handle an accepted frame; return False if the frame is ignored because of its length.

        The next heartbeat must arrive within the heartbeat time. A boot-up message is not a heartbeat: a
        master that sends only boot-up messages restarts repeatedly and does not monitor the instrument.
        """
        if len(frame.data) != 1:
            return False
        if frame.data != _BOOT_UP:
            self._recovered(now_s)
            if frame.id - HEARTBEAT.base_id == self._configured[0]:
                self._running = self._configured
            self._deadline_s = now_s + self._running[1]
        return True

    def timed_out(self, now_s: float) -> bool:
        """Return True once when the heartbeat is overdue, after informing the source."""
        if now_s <= self._deadline_s:
            return False
        self.lost = True
        self._deadline_s = math.inf
        self._source.master_lost(now_s)
        return True

    def _recovered(self, now_s: float) -> None:
        if self.lost:
            self._source.master_recovered(now_s)
        self.lost = False


def _master(consumer_heartbeat: int) -> tuple[int, float]:
    """Return node id and heartbeat time [s] of the master in a value of 1016h:1; (0, 0.0) if disabled."""
    node_id, time_ms = consumer_heartbeat >> 16 & 0x7F, consumer_heartbeat & 0xFFFF
    return (node_id, time_ms / 1e3) if node_id and time_ms else (0, 0.0)
