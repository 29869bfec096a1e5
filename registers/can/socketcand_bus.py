"""python-can's client of a socketcand server, with an end to its waiting: alone it would wait for ever."""

from __future__ import annotations

import select
import socket
import struct
import time
from collections import deque

import can
from can.interfaces.socketcand import SocketCanDaemonBus

from registers.can.socketcand import ECHO, Decoder

_ANSWER_S = 1.0
_SEND_BYTES = 4096  #: what the kernel may keep for a server that does not read
_SEND_S = 0.1
_ASK_S, _ECHO_S = 0.1, 0.4  #: how often a server is asked for an echo, and how long it may take


class DaemonBus(SocketCanDaemonBus):
    """A connection that has shaken hands."""

    def __init__(self, channel: str, host: str, port: int) -> None:
        """Connect. Raises OSError: nobody there, or somebody who does not speak the protocol."""
        self._decoder = Decoder()
        self._messages: deque[can.Message] = deque()
        self._echoes = False  #: whether this server ever answered
        self._asked_s = time.monotonic()
        self._heard_s = self._asked_s
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

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        """The next message: python-can's own takes a server's end for silence, and spins."""
        if not self._messages and select.select([self._link], [], [], timeout)[0]:
            data = self._link.recv(4096)
            if not data:
                raise can.CanOperationError("the server closed the connection")
            self._heard_s = time.monotonic()
            for words in self._decoder.feed(data):
                self._take(words)
        return (self._messages.popleft() if self._messages else None), False

    def _take(self, words: list[str]) -> None:
        if words == ["echo"]:
            self._echoes = True
        elif message := _message_of(words):
            self._messages.append(message)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:  # noqa: ARG002
        """Send within 0.1 s. Raises OSError: the server no longer reads, or no longer answers."""
        try:
            self._ask(time.monotonic())
            super().send(msg)  # type: ignore[no-untyped-call]
        except TimeoutError:
            # what the kernel has not sent yet would arrive late
            self._link.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            raise ConnectionError("the server does not read") from None

    def _ask(self, now_s: float) -> None:
        """Ask for an echo now and then. Raises TimeoutError: a server that used to answer has not."""
        if self._heard_s >= self._asked_s:
            if now_s >= self._asked_s + _ASK_S:
                self._asked_s = now_s
                self._link.sendall(ECHO)
        elif self._echoes and now_s > self._asked_s + _ECHO_S and not self._waits_to_be_read:
            raise TimeoutError

    @property
    def _waits_to_be_read(self) -> bool:
        """Whether the server has spoken, and this process had no time for it."""
        return bool(select.select([self._link], [], [], 0.0)[0])


def _message_of(words: list[str]) -> can.Message | None:
    """A message `frame`, or `error`: the class of what a controller reports."""
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
