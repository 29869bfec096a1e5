"""Listening socket that skips connections which the client has already closed.

A flood of short connections must not delay a vent request.
"""

from __future__ import annotations

import socket

from pneuforce.web.server.http_json import VENT_PATH

MIN_BACKLOG = 1024  #: minimum length of the queue of the kernel
ACCEPTS_PER_ROUND = 16  #: connections that the event loop accepts before open connections are served again
MAX_SKIPPED = 64  #: closed connections that one call of accept() skips
_VENT = f"POST {VENT_PATH} ".encode()
_TCP_CLOSE_WAIT = 8  # state of the connection in Linux: the client has closed the connection


class Listener(socket.socket):
    """Listening TCP socket with a long queue."""

    def listen(self, backlog: int = MIN_BACKLOG, /) -> None:
        """Start listening, with a queue of at least `MIN_BACKLOG` connections.

        uvicorn passes `ACCEPTS_PER_ROUND`, which is too small for the queue of the kernel.
        """
        super().listen(max(backlog, MIN_BACKLOG))

    def accept(self) -> tuple[socket.socket, object]:
        """Return the next connection that the client has not closed, and the address of the client.

        Raises BlockingIOError if no such connection waits.
        """
        for _ in range(MAX_SKIPPED):
            connection, address = super().accept()
            if not _is_closed(connection):
                return connection, address
            connection.close()
        raise BlockingIOError


def _is_closed(connection: socket.socket) -> bool:
    """Return True if the client has closed or reset the connection, unless the client has sent a vent."""
    try:
        if connection.recv(len(_VENT), socket.MSG_PEEK | socket.MSG_DONTWAIT) == _VENT:
            return False
        return connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, 1)[0] == _TCP_CLOSE_WAIT
    except BlockingIOError:
        return False
    except OSError:
        return True


def open_listener(host: str, port: int) -> Listener:
    """Return a socket that listens on an address. Raises OSError if the address is invalid or in use."""
    family, kind, _, _, address = socket.getaddrinfo(
        host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
    )[0]
    listener = Listener(family, kind)
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if family == socket.AF_INET6:
            listener.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, int(host != "::"))
        # Nagle's algorithm and delayed ACK would add 40 ms to each response on a persistent connection.
        listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        listener.bind(address[:2])
        listener.listen()
    except OSError:
        listener.close()
        raise
    return listener
