"""python-can's socketcand client with time limits.

Without these limits, the client waits forever for a server that does not respond.
"""

from __future__ import annotations

import socket
import struct
import time
from collections import deque

import can
from can.interfaces.socketcand import SocketCanDaemonBus

from pneuforce.registers.can.socketcand import ECHO, SocketcandDecoder
from pneuforce.support.readiness import readable

_RESPONSE_TIMEOUT_S = 1.0
_SEND_BUFFER_BYTES = 4096  #: size of the kernel's send buffer, which fills if the server stops reading
_SEND_TIMEOUT_S = 0.1
_ECHO_PERIOD_S, _ECHO_TIMEOUT_S = 0.1, 0.4


class SocketcandBus(SocketCanDaemonBus):
    """Connection to a socketcand server, after the handshake."""

    def __init__(self, channel: str, host: str, port: int) -> None:
        """Connect to the server.

        Raises OSError if no server listens on the port, or if it does not use the socketcand protocol.
        """
        self._decoder = SocketcandDecoder()
        self._messages: deque[can.Message] = deque()
        self._server_echoes = False  #: True once this server has answered an echo request
        self._echo_sent_s = time.monotonic()
        self._received_s = self._echo_sent_s
        # Test the port first: this fails at once if the port is closed. python-can would retry for 10 s.
        socket.create_connection((host, port), _RESPONSE_TIMEOUT_S).close()
        try:
            super().__init__(channel=channel, host=host, port=port, tcp_tune=True)  # type: ignore[no-untyped-call]
        except BaseException:
            self._link.close()
            raise
        self._link.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER_BYTES)
        self._link.settimeout(_SEND_TIMEOUT_S)

    @property
    def _link(self) -> socket.socket:
        link: socket.socket = self._SocketCanDaemonBus__socket  # type: ignore[attr-defined]
        return link

    def _expect_msg(self, msg: str) -> None:
        """Read one message byte by byte, so that no byte after the message is read.

        Raises OSError if a different message arrives, or if no message arrives within 1 s.
        """
        self._link.settimeout(_RESPONSE_TIMEOUT_S)
        received = b""
        while not received.endswith(b">") and len(received) < 200:
            piece = self._link.recv(1)
            if not piece:
                break
            received += piece
        if received != msg.encode("ascii"):
            raise ConnectionError(
                f"not a socketcand server, or the server rejected the connection (received {received!r})"
            )

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        """Return the next message, or None after `timeout` seconds; the bool is always False (not filtered).

        python-can's own method treats a closed connection as silence and loops without a wait.
        """
        if not self._messages and readable([self._link.fileno()], timeout):
            data = self._link.recv(4096)
            if not data:
                raise can.CanOperationError("the server closed the connection")
            self._received_s = time.monotonic()
            for words in self._decoder.feed(data):
                self._handle(words)
        return (self._messages.popleft() if self._messages else None), False

    def _handle(self, words: list[str]) -> None:
        if words == ["echo"]:
            self._server_echoes = True
        elif message := _parse_message(words):
            self._messages.append(message)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:  # noqa: ARG002
        """Send a message within 0.1 s. Raises OSError if the server no longer reads or no longer responds."""
        try:
            self._check_echo(time.monotonic())
            super().send(msg)  # type: ignore[no-untyped-call]
        except TimeoutError:
            # Discard the bytes that the kernel has not sent yet, because they would arrive late.
            self._link.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            raise ConnectionError("the server does not read") from None

    def _check_echo(self, now_s: float) -> None:
        """Request an echo every 0.1 s.

        Raises TimeoutError if the server has answered before but does not answer a request within 0.4 s.
        """
        if self._received_s >= self._echo_sent_s:
            if now_s >= self._echo_sent_s + _ECHO_PERIOD_S:
                self._echo_sent_s = now_s
                self._link.sendall(ECHO)
        elif (
            self._server_echoes and now_s > self._echo_sent_s + _ECHO_TIMEOUT_S and not self._has_unread_data
        ):
            raise TimeoutError

    @property
    def _has_unread_data(self) -> bool:
        """Return True if this process has not yet read all data that the server has sent."""
        return bool(readable([self._link.fileno()], 0.0))


def _parse_message(words: list[str]) -> can.Message | None:
    """Return the CAN message of a `frame` or `error` message; None if `words` are anything else.

    The identifier in an `error` message is the error class that the controller reports.
    """
    try:
        kind, number, t_s, *data = words
        return can.Message(
            timestamp=float(t_s),
            arbitration_id=int(number, 16),
            is_extended_id=len(number) > 3,
            is_error_frame={"frame": False, "error": True}[kind],
            data=bytes.fromhex("".join(data)),
        )
    except (ValueError, KeyError):
        return None
