"""python-can bus that is connected to a socketcand server, with time limits.

python-can has a socketcand client of its own, which waits forever for a server that does not respond. This
module uses only the public interface of python-can (`can.BusABC`), which changes seldom.
"""

from __future__ import annotations

import socket
import struct
import time
from collections import deque
from contextlib import suppress

import can

from pneuforce.registers.can.socketcand import (
    ECHO,
    GREETING,
    OK,
    RAW_MODE,
    SocketcandDecoder,
    open_message,
    send_message,
)
from pneuforce.support.readiness import readable

_RESPONSE_TIMEOUT_S = 1.0
_SEND_BUFFER_BYTES = 4096  #: size of the kernel's send buffer, which fills if the server stops reading
_SEND_TIMEOUT_S = 0.1
_ECHO_PERIOD_S, _ECHO_TIMEOUT_S = 0.1, 0.4
_CLOSE_TIMEOUT_S = 0.5


class SocketcandBus(can.BusABC):
    """Connection to a socketcand server, after the handshake."""

    def __init__(self, channel: str, host: str, port: int) -> None:
        """Connect to the server.

        Raises OSError if no server listens on the port, or if it does not use the socketcand protocol.
        """
        self._decoder = SocketcandDecoder()
        self._messages: deque[can.Message] = deque()
        self._discards = False  #: True if the close discards the frames that the system has not sent yet
        self._server_echoes = False  #: True once this server has answered an echo request
        self._echo_sent_s = time.monotonic()
        self._received_s = self._echo_sent_s
        self._link = socket.create_connection((host, port), _RESPONSE_TIMEOUT_S)
        try:
            self._link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._expect(GREETING)
            for request in (open_message(channel), RAW_MODE):
                self._link.sendall(request)
                self._expect(OK)
            super().__init__(channel=channel)
        except BaseException:
            self._link.close()
            raise
        self.channel_info = f"socketcand {channel} at {host}:{port}"
        self._link.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER_BYTES)
        self._link.settimeout(_SEND_TIMEOUT_S)

    def _expect(self, message: bytes) -> None:
        """Read one message byte by byte, so that no byte after the message is read.

        Raises OSError if a different message arrives, or if no message arrives within 1 s.
        """
        received = b""
        while not received.endswith(b">") and len(received) < 200:
            piece = self._link.recv(1)
            if not piece:
                break
            received += piece
        if received != message:
            raise ConnectionError(
                f"not a socketcand server, or the server rejected the connection (received {received!r})"
            )

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        """Return the next message, or None after `timeout` seconds; the bool is always False (not filtered).

        Raises CanOperationError if the server has closed the connection, OSError if the connection is lost.
        """
        if not self._messages and readable([self._link.fileno()], timeout):
            data = self._link.recv(4096)
            # A delayed acknowledgement would delay the next frames of a server that uses Nagle's algorithm.
            self._link.setsockopt(socket.IPPROTO_TCP, socket.TCP_QUICKACK, 1)
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
            self._link.sendall(send_message(msg.arbitration_id, msg.is_extended_id, msg.dlc, msg.data))
        except TimeoutError:
            # Discard the bytes that the kernel has not sent yet, because they would arrive late.
            self._link.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            self._discards = True
            raise ConnectionError("the server does not read") from None

    def shutdown(self) -> None:
        """Close the connection after the server has read all frames, at most 0.5 s later."""
        super().shutdown()
        if not self._discards:
            with suppress(OSError):
                self._wait_until_read()
        self._link.close()

    def _wait_until_read(self) -> None:
        """End the transmission, and read until the server closes the connection.

        Otherwise the system resets the connection, because received data is unread (RFC 2525, section 2.17).
        A server that then sends a frame loses the frames that it has not read yet.
        """
        until_s = time.monotonic() + _CLOSE_TIMEOUT_S
        self._link.shutdown(socket.SHUT_WR)
        while (left_s := until_s - time.monotonic()) > 0:
            if readable([self._link.fileno()], left_s) and not self._link.recv(4096):
                return

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
