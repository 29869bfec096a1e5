"""Modbus TCP server on asyncio: listening socket and list of allowed addresses."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from pneuforce.registers.modbus.connection import ModbusTcpConnection
from pneuforce.registers.modbus.connection_pool import ConnectionPool
from pneuforce.registers.modbus.device_identification import DeviceIdentification
from pneuforce.registers.modbus.open_file_limit import ACCEPTED_PER_PASS, raise_open_file_limit
from pneuforce.registers.modbus.pdu import RequestHandler
from pneuforce.registers.modbus.register_bank import RegisterBank
from pneuforce.registers.source import Source
from pneuforce.support.allow_list import AllowList


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


class ModbusTcpServer(ConnectionPool):
    """Server for one source on one TCP port. The pool accepts every client at an allowed address."""

    def __init__(
        self,
        source: Source,
        options: ModbusTcpOptions,
        identity: Mapping[int, str],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        bank = RegisterBank(word_swap=options.word_swap)
        handler = RequestHandler(
            bank, source, DeviceIdentification(identity), writable=() if options.read_only else None
        )
        super().__init__(options, handler, clock)
        self.options = options
        self._allow_list = AllowList(options.allow)
        self._server: asyncio.Server | None = None

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
        self.begin()

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

    def close(self) -> None:
        """Stop listening and close every connection after its remaining answers have been sent."""
        if self._server is not None:
            self._server.close()
            super().close()

    def admit(self, connection: ModbusTcpConnection) -> None:
        """Register a new connection, or close it if its address is not allowed."""
        if self._allow_list.admits(connection.address):
            super().admit(connection)
        else:
            self.counters.not_allowed += 1
            connection.reject()
