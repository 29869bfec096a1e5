"""Modbus TCP over asyncio: sockets and time-outs; what is said over them is decided elsewhere."""

from __future__ import annotations

import asyncio
import logging
import time
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from registers.modbus.allow import AllowList
from registers.modbus.bank import Bank
from registers.modbus.connection import Connection
from registers.modbus.descriptors import ACCEPTED_AT_ONCE, make_room
from registers.modbus.identity import Identity
from registers.modbus.pdu import Responder
from registers.modbus.turns import Turns
from registers.source import Source
from registers.sparing_log import SparingLog

#: Unit identifiers by which a TCP master may mean "whoever is at this address".
_ANY_UNIT = frozenset((0, 255))


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """How the server listens, answers, and when it gives a client up."""

    host: str = "127.0.0.1"
    port: int = 5020
    allow: tuple[str, ...] = ()  #: addresses and networks that may connect; all, where empty
    unit: int = 1
    word_swap: bool = False  #: low word of a 32-bit value first
    read_only: bool = False
    most_connections: int = 64  #: the next one is accepted, and another closed: see ModbusTcpServer
    idle_s: float = 60.0  #: without a byte from the client
    frame_s: float = 5.0  #: for a frame to be completed, and for a client to read its answers
    write_buffer_bytes: int = 65536  #: unread answers at which a client's requests are no longer read


@dataclass(slots=True)
class Counters:
    """What the server has seen since it was made."""

    clients: int = 0  #: connected now
    connections: int = 0  #: accepted
    foreign: int = 0  #: closed at once, for their address may not connect; counted nowhere else
    evicted: int = 0  #: closed to make room for a newcomer, over the connection limit
    requests: int = 0
    exceptions: int = 0  #: requests answered with an exception code
    refused_frames: int = 0  #: headers or functions that no request has; each closed its connection
    timeouts: int = 0  #: connections closed for being idle, unfinished or not reading


class ModbusTcpServer:
    """One source on one TCP port.

    Whoever may connect is accepted, for it may want to vent. Where that is over the connection limit, the
    address with most connections (the newcomer counted with its own) loses the one that was silent for
    longest, never the newcomer: a flood from one address evicts nobody but itself.
    """

    def __init__(
        self,
        source: Source,
        options: Options,
        identity: Mapping[int, str],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.options = options
        self.counters = Counters()
        self.clock = clock
        self.units = _ANY_UNIT | {options.unit}
        self.log = SparingLog(logging.getLogger(__name__))
        self._allowed = AllowList(options.allow)
        bank = Bank(word_swap=options.word_swap)
        self.responder = Responder(bank, source, Identity(identity), read_only=options.read_only)
        self.turns = Turns(clock)
        self.connections: set[Connection] = set()
        self._server: asyncio.Server | None = None
        self._sweep: asyncio.TimerHandle | None = None

    async def start(self) -> None:
        """Listen. Raises OSError where the address cannot be had, or not enough files be opened."""
        make_room(self.options.most_connections)
        loop = asyncio.get_running_loop()
        self._server = await loop.create_server(
            lambda: Connection(self), self.options.host, self.options.port, backlog=ACCEPTED_AT_ONCE
        )
        self._sweep_every(min(self.options.frame_s, self.options.idle_s, 2.0) / 4)

    @property
    def listening(self) -> bool:
        """Whether it has started."""
        return self._server is not None

    @property
    def port(self) -> int:
        """The port that is listened on; differs from the option where that is 0."""
        assert self._server is not None
        port: int = self._server.sockets[0].getsockname()[1]
        return port

    def close(self) -> None:
        """Stop listening and close every connection, once what its client reads has been sent."""
        if self._server is None or self._sweep is None:
            return
        self._sweep.cancel()
        self._server.close()
        for connection in list(self.connections):
            connection.close()

    def admit(self, newcomer: Connection) -> None:
        """Count a connection in; over the limit, close another one. Close it where it may not connect."""
        if not self._allowed.admits(newcomer.address):
            self.counters.foreign += 1
            newcomer.turn_away()
            return
        if len(self.connections) >= self.options.most_connections:
            held = Counter(c.address for c in (*self.connections, newcomer))
            self.counters.evicted += 1
            max(self.connections, key=lambda c: (held[c.address], -c.heard_s)).evict(newcomer.address)
        self.connections.add(newcomer)
        self.counters.connections += 1
        self.counters.clients += 1

    def count_out(self, connection: Connection) -> None:
        """Forget a connection that is gone; once is enough."""
        if connection in self.connections:
            self.connections.remove(connection)
            self.counters.clients -= 1

    def _sweep_every(self, period_s: float) -> None:
        """Close the connections whose time is up, now and every `period_s`."""
        now_s = self.clock()
        for connection in list(self.connections):
            connection.close_if_overdue(now_s)
        self._sweep = asyncio.get_running_loop().call_later(period_s, self._sweep_every, period_s)
