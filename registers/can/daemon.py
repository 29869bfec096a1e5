"""python-can's client of a socketcand server, with an end to its waiting: alone it would wait for ever."""

from __future__ import annotations

import select
import socket
import struct

import can
from can.interfaces.socketcand import SocketCanDaemonBus

_ANSWER_S = 1.0
_SEND_BYTES = 2048  #: what the kernel may keep for a server that does not read
_SEND_S = 0.1


class DaemonBus(SocketCanDaemonBus):
    """A connection that has shaken hands."""

    def __init__(self, channel: str, host: str, port: int) -> None:
        """Connect. Raises OSError: nobody there, or somebody who does not speak the protocol."""
        # python-can hammers a closed port for 10 s
        socket.create_connection((host, port), _ANSWER_S).close()
        try:
            super().__init__(channel=channel, host=host, port=port, tcp_tune=True)  # type: ignore[no-untyped-call]
        except BaseException:
            self._link.close()
            raise
        self._link.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BYTES)
        self._link.settimeout(_SEND_S)

    @property
    def _link(self) -> socket.socket:
        link: socket.socket = self._SocketCanDaemonBus__socket  # type: ignore[attr-defined]
        return link

    def _expect_msg(self, msg: str) -> None:
        """Take one message and no byte of what comes behind it."""
        self._link.settimeout(_ANSWER_S)
        heard = b""
        while not heard.endswith(b">") and len(heard) < 200:
            piece = self._link.recv(1)
            if not piece:
                break
            heard += piece
        if heard != msg.encode("ascii"):
            raise ConnectionError(f"no socketcand server answers there (heard {heard!r})")

    def trouble(self) -> str:
        """Why this bus has ended, empty while it lives: python-can takes a server's end for silence."""
        readable, _, _ = select.select([self._link], [], [], 0.0)
        gone = readable and not self._link.recv(1, socket.MSG_PEEK)
        return "the server closed the connection" if gone else ""

    def send(self, msg: can.Message, timeout: float | None = None) -> None:  # noqa: ARG002
        """Send within 0.1 s. Raises OSError; what the kernel keeps is then thrown away: it would be late."""
        try:
            super().send(msg)  # type: ignore[no-untyped-call]
        except TimeoutError:
            self._link.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            raise ConnectionError("the server does not read") from None
