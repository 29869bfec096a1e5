"""Where connections come in: those that are dead already do not, for a flood of them would hold up a vent."""

from __future__ import annotations

import socket

QUEUE = 1024  #: connections that wait outside
AT_ONCE = 16  #: that are let in before those inside are heard again
MOST_DEAD = 64  #: that are turned away meanwhile, for each that is let in


class Door(socket.socket):
    """A socket that listens."""

    def listen(self, backlog: int = QUEUE, /) -> None:
        """Let connections wait: as many as there is room for, whatever is asked."""
        super().listen(max(backlog, QUEUE))

    def accept(self) -> tuple[socket.socket, object]:
        """The next one that somebody still holds. Raises BlockingIOError: there is none now."""
        for _ in range(MOST_DEAD):
            guest, address = super().accept()
            if not _is_dead(guest):
                return guest, address
            guest.close()
        raise BlockingIOError


def _is_dead(guest: socket.socket) -> bool:
    try:
        return not guest.recv(1, socket.MSG_PEEK | socket.MSG_DONTWAIT)
    except BlockingIOError:
        return False
    except OSError:
        return True


def door(host: str, port: int) -> Door:
    """A socket that listens. Raises OSError."""
    family, kind, _, _, address = socket.getaddrinfo(
        host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
    )[0]
    bound = Door(family, kind)
    try:
        bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if family == socket.AF_INET6:
            bound.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, int(host != "::"))
        bound.setsockopt(
            socket.IPPROTO_TCP, socket.TCP_NODELAY, 1
        )  # else each answer on a kept line takes 40 ms
        bound.bind(address[:2])
        bound.listen()
    except OSError:
        bound.close()
        raise
    return bound
