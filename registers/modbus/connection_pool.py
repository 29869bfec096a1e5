"""Connections of one Modbus server: connection limit, eviction and time-outs."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from typing import Protocol

from pneuforce.registers.modbus.connection import ConnectionLimits, ModbusTcpConnection, ModbusTcpCounters
from pneuforce.registers.modbus.eviction import select_evicted
from pneuforce.registers.modbus.pdu import RequestHandler
from pneuforce.registers.modbus.round_robin import RoundRobinScheduler
from pneuforce.support.throttle import RateLimitedLogger

#: Unit identifiers that TCP masters use for "the device at this IP address".
_ANY_UNIT = frozenset((0, 255))


class PoolOptions(ConnectionLimits, Protocol):
    """Options of a pool."""

    @property
    def unit(self) -> int:
        """Return the unit id of the instrument."""
        ...

    @property
    def max_connections(self) -> int:
        """Return the limit; a new connection above this limit closes an older one."""
        ...


class ConnectionPool:
    """Open connections of one server.

    Every client is accepted, because the client may request a vent. If the connection limit is exceeded, the
    pool closes another connection: first a client without a request, then an idle client, and last a client
    that polls, newcomers before clients with a long history; see `select_evicted`. The new connection is
    never closed.
    """

    def __init__(
        self, options: PoolOptions, request_handler: RequestHandler, clock: Callable[[], float]
    ) -> None:
        self.limits = options
        self.request_handler = request_handler
        self.clock = clock
        self.counters = ModbusTcpCounters()
        self.units = _ANY_UNIT | {options.unit}
        self.scheduler = RoundRobinScheduler(clock)
        self.connections: set[ModbusTcpConnection] = set()
        self._log = RateLimitedLogger(logging.getLogger(__name__))
        self._timeout_timer: asyncio.TimerHandle | None = None

    def begin(self) -> None:
        """Close connections that time out, from now on."""
        period_s = min(self.limits.frame_timeout_s, self.limits.idle_timeout_s, 2.0) / 4
        self._check_timeouts_every(period_s)

    def close(self) -> None:
        """Close every connection after its remaining answers have been sent."""
        if self._timeout_timer is not None:
            self._timeout_timer.cancel()
        for connection in list(self.connections):
            connection.close()

    def admit(self, connection: ModbusTcpConnection) -> None:
        """Register a new connection. If the connection limit is reached, another connection is closed."""
        if len(self.connections) >= self.limits.max_connections:
            self.counters.evicted += 1
            evicted = select_evicted(self.connections, connection.address, self.clock())
            evicted.evict(connection.address)
        self.connections.add(connection)
        self.counters.connections += 1
        self.counters.clients += 1

    def remove(self, connection: ModbusTcpConnection) -> None:
        """Unregister a connection. Unknown connections are ignored."""
        if connection in self.connections:
            self.connections.remove(connection)
            self.counters.clients -= 1

    def log_warning(self, message: str, *args: object) -> None:
        """Log a rate-limited warning."""
        self._log.warning(self.clock(), message, *args)

    def _check_timeouts_every(self, period_s: float) -> None:
        """Close the connections that have timed out, now and every `period_s`."""
        now_s = self.clock()
        for connection in list(self.connections):
            connection.close_if_timed_out(now_s)
        loop = asyncio.get_running_loop()
        self._timeout_timer = loop.call_later(period_s, self._check_timeouts_every, period_s)
