"""Who is connected: those who may, and no more than there is room for."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterable
from typing import TYPE_CHECKING

from registers.modbus.allow import AllowList
from registers.sparing_log import SparingLog

if TYPE_CHECKING:
    from page.connection import Connection

Client = tuple[str, int]

MOST_CONNECTIONS = 512
MOST_OF_ONE = 384  #: address; one that takes more makes room for itself
LOOPBACK = ("127.0.0.1", "::1")


class Crowd:
    """The connections by their far ends."""

    def __init__(self, allow: Iterable[str]) -> None:
        """`allow`: networks that may connect beside this machine. Raises ValueError where one is none."""
        self._allowed = AllowList((*LOOPBACK, *allow))
        self._connections: dict[Client, Connection] = {}
        self._log = SparingLog(logging.getLogger("pneuforce"), 60.0)

    def __len__(self) -> int:
        return len(self._connections)

    def join(self, connection: Connection) -> None:
        """Take one in, or cut it off where it may not connect; the oldest that asks nothing makes room."""
        client = connection.client
        if client is None or not self._allowed.admits(client[0]):
            self._log.say(time.monotonic(), "page: a connection from %s was refused", client and client[0])
            connection.transport.abort()
            return
        self._connections[client] = connection
        theirs = [c for (address, _), c in self._connections.items() if address == client[0]]
        if len(theirs) > MOST_OF_ONE:
            self._make_room(theirs)
        elif len(self._connections) > MOST_CONNECTIONS:
            self._make_room(list(self._connections.values()))

    def _make_room(self, among: list[Connection]) -> None:
        """Cut off the oldest that has no request under way; where each has one, the latest."""
        self._cut_off(next((connection for connection in among if not connection.busy), among[-1]))

    def leave(self, connection: Connection) -> None:
        """Forget one that is gone."""
        if connection.client is not None and self._connections.get(connection.client) is connection:
            del self._connections[connection.client]

    def keep(self, client: Client) -> None:
        """Let this one stay: a stream, of which there are few."""
        if client in self._connections:
            self._connections[client].stream()

    def drop(self, client: Client) -> None:
        """Cut one off, with all that it has not taken."""
        if client in self._connections:
            self._connections[client].forget()
            self._cut_off(self._connections[client])

    def _cut_off(self, connection: Connection) -> None:
        self.leave(connection)  # now, for the loop tells it of its end only later
        connection.transport.abort()
