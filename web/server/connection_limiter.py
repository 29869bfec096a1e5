"""Limit on the number of connections, and the check of the client address."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Iterable
from typing import Protocol

from pneuforce.support.allow_list import AllowList
from pneuforce.support.throttle import RateLimitedLogger
from pneuforce.web.server.client_network import client_network
from pneuforce.web.server.eviction import EvictionQueue, Protection

ClientAddress = tuple[str, int]  #: IP address and port

MAX_CONNECTIONS = 512
MAX_CONNECTIONS_PER_ADDRESS = 384
LOOPBACK = ("127.0.0.1", "::1")


class LimitedConnection(Protocol):
    """Interface of a connection that the limiter can abort."""

    client: ClientAddress | None
    transport: asyncio.Transport

    @property
    def protection(self) -> Protection:
        """Return the protection of the connection against eviction."""

    @property
    def has_unread_bytes(self) -> bool:
        """Return True if bytes of the client wait in the socket."""

    def start_streaming(self) -> None:
        """Configure the connection for an endless response."""

    def discard_unsent(self) -> None:
        """Make the next close drop the data that the client has not read."""


class ConnectionLimiter:
    """Limiter for the number of open connections, in total and per client network."""

    def __init__(self, allow: Iterable[str]) -> None:
        """Create a limiter for this machine and the networks in `allow`.

        Raises ValueError if an item of `allow` is neither an address nor a network.
        """
        self._allowed = AllowList((*LOOPBACK, *allow))
        self._connections: dict[ClientAddress, LimitedConnection] = {}
        self._queues: dict[str, EvictionQueue[LimitedConnection]] = {}
        self._log = RateLimitedLogger(logging.getLogger("pneuforce"), 60.0)

    def __len__(self) -> int:
        return len(self._connections)

    def admit(self, connection: LimitedConnection) -> None:
        """Add a new connection, or abort the connection if its address is not allowed.

        If one address has too many connections, abort one of its other connections. If there are too many
        connections in total, abort a connection of the address with the most connections. If all other
        connections are protected or have sent bytes that were not yet processed, abort no connection.
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
        former = self._connections.get(client)
        if former is not None:  # it has ended: the client uses the port again, and the event loop is late
            self._abort(former)
        self._connections[client] = connection
        queue = self._queues.setdefault(client_network(client[0]), EvictionQueue())
        queue.place(connection, connection.protection, time.monotonic())
        while len(queue) > MAX_CONNECTIONS_PER_ADDRESS and self._evict_one(queue, connection):
            pass
        while len(self._connections) > MAX_CONNECTIONS and self._evict_any(connection):
            pass

    def _evict_any(self, newcomer: LimitedConnection) -> bool:
        queues = sorted(self._queues.values(), key=len, reverse=True)
        return any(self._evict_one(queue, newcomer) for queue in queues)

    def _evict_one(self, queue: EvictionQueue[LimitedConnection], newcomer: LimitedConnection) -> bool:
        """Abort one connection except the newcomer. Return False if no connection can be aborted."""
        for candidate in queue.candidates():
            if candidate is not newcomer and not candidate.has_unread_bytes:
                self._abort(candidate)
                return True
        return False

    def update(self, connection: LimitedConnection) -> None:
        """Update the protection of a connection after a request or an answer has made progress."""
        client = connection.client
        if client is not None and self._connections.get(client) is connection:
            queue = self._queues[client_network(client[0])]
            queue.place(connection, connection.protection, time.monotonic())

    def remove(self, connection: LimitedConnection) -> None:
        """Remove a connection that is closed."""
        client = connection.client
        if client is None or self._connections.get(client) is not connection:
            return
        del self._connections[client]
        network = client_network(client[0])
        self._queues[network].remove(connection)
        if not self._queues[network]:
            del self._queues[network]

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
