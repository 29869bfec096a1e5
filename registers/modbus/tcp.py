"""Modbus TCP server on asyncio: listening socket, connection limit and time-outs."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from pneuforce.registers.modbus.connection import ModbusTcpConnection, ModbusTcpCounters
from pneuforce.registers.modbus.device_identification import DeviceIdentification
from pneuforce.registers.modbus.eviction import select_evicted
from pneuforce.registers.modbus.open_file_limit import ACCEPTED_PER_PASS, raise_open_file_limit
from pneuforce.registers.modbus.pdu import RequestHandler
from pneuforce.registers.modbus.register_bank import RegisterBank
from pneuforce.registers.modbus.round_robin import RoundRobinScheduler
from pneuforce.registers.source import Source
from pneuforce.support.allow_list import AllowList
from pneuforce.support.throttle import RateLimitedLogger

#: Unit identifiers that TCP masters use for "the device at this IP address".
_ANY_UNIT = frozenset((0, 255))


@dataclass(frozen=True, slots=True, kw_only=True)
class ModbusTcpOptions:
    """Options of the server."""

    host: str = "127.0.0.1"
    port: int = 5020
    allow: tuple[str, ...] = ()  #: addresses and networks that may connect; empty: all
    unit: int = 1
    word_swap: bool = False  #: low word of a 32-bit value first
    read_only: bool = False
    max_connections: int = 64  #: a new connection above this limit closes an older one
    idle_timeout_s: float = 60.0  #: a connection is closed after this time without a byte from the client
    frame_timeout_s: float = 5.0  #: time limit for a complete frame, and for the client to read its answers
    write_buffer_bytes: int = 65536  #: unread answer bytes above which requests are no longer read


class ModbusTcpServer:
    """Server for one source on one TCP port.

    Every allowed client is accepted, because the client may request a vent. If the connection limit is
    exceeded, the server closes another connection: first a client without a request, then an idle client,
    and last a client that polls, newcomers before clients with a long history; see `select_evicted`. The new
    connection is never closed.
    """

    def __init__(
        self,
        source: Source,
        options: ModbusTcpOptions,
        identity: Mapping[int, str],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.options = options
        self.counters = ModbusTcpCounters()
        self.clock = clock
        self.units = _ANY_UNIT | {options.unit}
        self._log = RateLimitedLogger(logging.getLogger(__name__))
        self._allow_list = AllowList(options.allow)
        bank = RegisterBank(word_swap=options.word_swap)
        self.request_handler = RequestHandler(
            bank, source, DeviceIdentification(identity), read_only=options.read_only
        )
        self.scheduler = RoundRobinScheduler(clock)
        self.connections: set[ModbusTcpConnection] = set()
        self._server: asyncio.Server | None = None
        self._timeout_timer: asyncio.TimerHandle | None = None

    async def start(self) -> None:
        """Listen. Raises OSError if the address is not available or the limit of open files is too low."""
        raise_open_file_limit(self.options.max_connections)
        loop = asyncio.get_running_loop()
        self._server = await loop.create_server(
            lambda: ModbusTcpConnection(self),
            self.options.host,
            self.options.port,
            backlog=ACCEPTED_PER_PASS,
        )
        self._check_timeouts_every(min(self.options.frame_timeout_s, self.options.idle_timeout_s, 2.0) / 4)

    @property
    def listening(self) -> bool:
        """Return True if the server has started."""
        return self._server is not None

    @property
    def port(self) -> int:
        """Return the port on which the server listens. If option `port` is 0, the system selects a port."""
        assert self._server is not None
        port: int = self._server.sockets[0].getsockname()[1]
        return port

    @property
    def limits(self) -> ModbusTcpOptions:
        """Return the options, which contain the limits of each connection."""
        return self.options

    def close(self) -> None:
        """Stop listening and close every connection after its remaining answers have been sent."""
        if self._server is None or self._timeout_timer is None:
            return
        self._timeout_timer.cancel()
        self._server.close()
        for connection in list(self.connections):
            connection.close()

    def admit(self, connection: ModbusTcpConnection) -> None:
        """Register a new connection, or close it if its address is not allowed.

        If the connection limit is reached, another connection is closed.
        """
        if not self._allow_list.admits(connection.address):
            self.counters.not_allowed += 1
            connection.reject()
            return
        if len(self.connections) >= self.options.max_connections:
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
