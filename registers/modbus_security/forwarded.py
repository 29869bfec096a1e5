"""Modbus connections from the TLS gateway: a first line names the client, then Modbus TCP follows."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from pneuforce.registers.modbus.connection import ModbusTcpConnection
from pneuforce.registers.modbus.connection_pool import ConnectionPool, PoolOptions
from pneuforce.registers.modbus.device_identification import DeviceIdentification
from pneuforce.registers.modbus.pdu import RequestHandler
from pneuforce.registers.modbus.register_bank import RegisterBank
from pneuforce.registers.rights import VIEWER, writable_quantities
from pneuforce.registers.source import Peer, Source

CHANNEL = "modbus_tls"
MAX_LINE_BYTES = 1024


class ForwardedClient(NamedTuple):
    """Client of the gateway. TLS has verified its certificate."""

    address: str  #: IP address
    name: str  #: name in the certificate and fingerprint; leases and log entries belong to this name
    role: str

    def encode(self) -> bytes:
        """Return the first line of a forwarded connection."""
        return json.dumps(self._asdict()).encode() + b"\n"

    @classmethod
    def decode(cls, line: bytes) -> ForwardedClient:
        """Return the client in the first line. Raises ValueError if the line is invalid."""
        facts = json.loads(line)
        if not isinstance(facts, dict) or not all(isinstance(facts.get(name), str) for name in cls._fields):
            raise ValueError("the gateway did not name the client")
        return cls(**{name: facts[name] for name in cls._fields})


class ForwardedConnections(ConnectionPool):
    """Connections from the gateway. The role of a client decides what the client may write."""

    def __init__(
        self,
        source: Source,
        bank: RegisterBank,
        identity: Mapping[int, str],
        options: PoolOptions,
        roles: Mapping[str, tuple[str, ...]],
        clock: Callable[[], float],
    ) -> None:
        """Create the pool. `roles` maps each role to its rights. Raises KeyError for an unknown right."""
        identification = DeviceIdentification(identity)
        self._handlers = {
            role: RequestHandler(bank, source, identification, writable=writable_quantities(rights))
            for role, rights in ({VIEWER: ()} | dict(roles)).items()
        }
        super().__init__(options, self._handlers[VIEWER], clock)

    def handler_of(self, role: str) -> RequestHandler:
        """Return the handler of a role. An unknown role is a viewer."""
        return self._handlers.get(role, self._handlers[VIEWER])

    def new_connection(self) -> ForwardedConnection:
        """Return the protocol of a new connection."""
        return ForwardedConnection(self)


class ForwardedConnection(ModbusTcpConnection):
    """Connection of one client behind the gateway. It joins the pool after its first line."""

    def __init__(self, pool: ForwardedConnections) -> None:
        super().__init__(pool)
        self._pool = pool
        self._address = ""
        self._peer = Peer(CHANNEL)
        self._first_line: bytearray | None = bytearray()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Wait for the first line."""
        assert isinstance(transport, asyncio.Transport)
        self._set_transport(transport)

    @property
    def address(self) -> str:
        """Return the IP address of the client."""
        return self._address

    def buffer_updated(self, nbytes: int) -> None:
        """Read the first line, then requests."""
        if self._first_line is None:
            super().buffer_updated(nbytes)
            return
        self._first_line += self._buffer[:nbytes]
        line, end, rest = bytes(self._first_line).partition(b"\n")
        if end:
            self._begin(line, rest)
        elif len(line) > MAX_LINE_BYTES:
            self._transport.abort()

    def _begin(self, line: bytes, rest: bytes) -> None:
        try:
            client = ForwardedClient.decode(line)
        except ValueError:
            self._transport.abort()
            return
        self._first_line = None
        self._address = client.address
        self._peer = Peer(CHANNEL, client.name)
        self._request_handler = self._pool.handler_of(client.role)
        self._pool.admit(self)
        if rest:
            self._buffer[: len(rest)] = rest
            super().buffer_updated(len(rest))

    def eof_received(self) -> bool:
        """Close after the last answer, or at once if the client is unknown."""
        return super().eof_received() if self._first_line is None else False

    def health(self, now_s: float) -> dict[str, Any]:
        """Return the client and its counters, for the web page."""
        return super().health(now_s) | {"name": self._peer.address}
