"""Limit on the number of connections, and the check of the client address."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Iterable
from typing import Protocol

from pneuforce.support.allow_list import AllowList
from pneuforce.support.throttle import RateLimitedLogger

ClientAddress = tuple[str, int]  #: IP address and port

MAX_CONNECTIONS = 512
MAX_CONNECTIONS_PER_ADDRESS = 384
LOOPBACK = ("127.0.0.1", "::1")


class LimitedConnection(Protocol):
    """Interface of a connection that the limiter can abort."""

    client: ClientAddress | None
    transport: asyncio.Transport

    @property
    def busy(self) -> bool:
        """Return True if a request is in progress, or if request bytes wait in the socket."""

    def start_streaming(self) -> None:
        """Configure the connection for an endless response."""

    def discard_unsent(self) -> None:
        """Make the next close drop the data that the client has not read."""


class ConnectionLimiter:
    """Limiter for the number of open connections, in total and per client address."""

    def __init__(self, allow: Iterable[str]) -> None:
        """Create a limiter for this machine and the networks in `allow`.

        Raises ValueError if an item of `allow` is neither an address nor a network.
        """
        self._allowed = AllowList((*LOOPBACK, *allow))
        self._connections: dict[ClientAddress, LimitedConnection] = {}
        self._log = RateLimitedLogger(logging.getLogger("pneuforce"), 60.0)

    def __len__(self) -> int:
        return len(self._connections)

    def admit(self, connection: LimitedConnection) -> None:
        """Add a new connection, or abort the connection if its address is not allowed.

        If there are too many connections, abort the oldest connection that has no request in progress. If one
        address has too many connections, consider only the connections of that address.
        """
        client = connection.client
        if client is None or not self._allowed.admits(client[0]):
            self._log.warning(
                time.monotonic(),
                "web: connection from %s rejected: the address is not in [web] allow",
                client[0] if client else "an unknown address",
            )
            connection.transport.abort()
            return
        self._connections[client] = connection
        same_address = [c for (address, _), c in self._connections.items() if address == client[0]]
        if len(same_address) > MAX_CONNECTIONS_PER_ADDRESS:
            self._evict_one(same_address)
        elif len(self._connections) > MAX_CONNECTIONS:
            self._evict_one(list(self._connections.values()))

    def _evict_one(self, candidates: list[LimitedConnection]) -> None:
        """Abort the oldest connection without a request in progress, or the newest if all are busy."""
        self._abort(next((connection for connection in candidates if not connection.busy), candidates[-1]))

    def remove(self, connection: LimitedConnection) -> None:
        """Remove a connection that is closed."""
        if connection.client is not None and self._connections.get(connection.client) is connection:
            del self._connections[connection.client]

    def start_streaming(self, client: ClientAddress) -> None:
        """Mark the connection of a client as an event stream."""
        if client in self._connections:
            self._connections[client].start_streaming()

    def disconnect(self, client: ClientAddress) -> None:
        """Abort the connection of a client, and drop the data that the client has not read."""
        if client in self._connections:
            self._connections[client].discard_unsent()
            self._abort(self._connections[client])

    def _abort(self, connection: LimitedConnection) -> None:
        self.remove(connection)  # do not wait until the event loop reports the end of the connection
        connection.transport.abort()
