"""One connection to the server under test: blocking, and never for long."""

from __future__ import annotations

import itertools
import select
import socket
import struct
import time
from contextlib import suppress
from dataclasses import dataclass

from tests.hostile.case import Ask, Wrong, framed

PROBE = Ask("03 0000 0001", ("03 02 ....", "83 0[1-4]"))
_PATTERN = ("03 0f00 0005", "030ac2f6e66612345678cfc7")  #: of the pneuforce register map, in the order ABCD
_RESET = struct.pack("ii", 1, 0)  # SO_LINGER: close with RST


@dataclass(frozen=True, slots=True)
class Server:
    """Where the server is, and the times that hold for it."""

    host: str = "127.0.0.1"
    port: int = 5020
    unit: int = 1
    patience_s: float = 2.0  #: no answer and no end within it is silence
    frame_s: float = 5.0  #: within which, and the patience, it must close a frame left unfinished
    idle_s: float = 60.0
    connections: int = 64  #: its limit, where it is a pneuforce instrument
    ours: bool = False

    def is_pneuforce(self) -> bool:
        """Whether it shows the test pattern of the pneuforce register map."""
        with Line(self) as line:
            return line.said(_PATTERN[0]) == _PATTERN[1]


class Line:
    """One connection. What is sent after the server has closed is lost, as on any wire."""

    numbers = itertools.cycle(range(0x0101, 0xFFFF))  #: of transactions, never twice in a row

    def __init__(self, server: Server, source: str | None = None, **buffers: int) -> None:
        """Connect, from another address of this machine where `source` names one. Raises Wrong."""
        self._server = server
        self._received = b""
        self.closed = False
        try:
            self.socket = _connected(server, source, buffers)
        except OSError as error:
            raise Wrong(f"no connection: {error.strerror or error}") from None

    def __enter__(self) -> Line:
        return self

    def __exit__(self, *_: object) -> None:
        self.socket.close()

    def reset(self) -> None:
        """End with RST instead of FIN."""
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _RESET)
        self.socket.close()

    def send(self, data: bytes) -> None:
        """Send; what the server has closed takes nothing."""
        with suppress(OSError):
            self.socket.sendall(data)

    def half_close(self) -> None:
        """Send FIN."""
        with suppress(OSError):
            self.socket.shutdown(socket.SHUT_WR)

    def ask(self, ask: Ask) -> int:
        """Send one request; the number of its transaction."""
        number, data = self.frame_of(ask)
        self.send(data)
        return number

    def frame_of(self, ask: Ask) -> tuple[int, bytes]:
        """The number of a request's transaction, and its frame."""
        number = next(self.numbers) if ask.number is None else ask.number
        unit = self._server.unit if ask.unit is None else ask.unit
        return number, framed(number, unit, bytes.fromhex(ask.pdu))

    def said(self, pdu: str) -> str:
        """The answer to one request, both as PDUs in hex. Raises Wrong."""
        self.ask(Ask(pdu, ()))
        return self.answer(self._server.patience_s)[2]

    def answer(self, within_s: float) -> tuple[int, int, str]:
        """Transaction, unit and PDU in hex of the next answer. Raises Wrong: closed, or silent."""
        until_s = time.monotonic() + within_s
        while not (frame := self._taken()):
            if self._ended(until_s):
                raise Closed("cut short" if self._received else "closed")
        return frame

    def _taken(self) -> tuple[int, int, str] | None:
        if len(self._received) < 8:
            return None
        number, protocol, length, unit = struct.unpack_from(">HHHB", self._received)
        if protocol or not 3 <= length <= 254:
            raise Wrong(f"no Modbus frame: {self._received[:12].hex(' ')}")
        frame, rest = self._received[: 6 + length], self._received[6 + length :]
        if len(frame) < 6 + length:
            return None
        self._received = rest
        return number, unit, frame[7:].hex()

    def _ended(self, until_s: float) -> bool:
        """Whether the server has closed; else what it sent is taken in. Raises Silent."""
        if not self.readable(max(0.0, until_s - time.monotonic())):
            raise Silent("silent, and open")
        try:
            data = self.socket.recv(65536)
        except OSError:
            data = b""
        self._received += data
        self.closed = not data
        return self.closed

    def readable(self, within_s: float) -> bool:
        """Whether an answer or the end comes within a time."""
        return bool(select.select([self.socket], [], [], within_s)[0])

    def wait_closed(self, within_s: float) -> str:
        """Wait for the end; how it came. Raises Wrong where an answer comes instead, or neither."""
        begun_s = time.monotonic()
        try:
            answer = self.answer(within_s)
        except Closed:
            return f"closed after {time.monotonic() - begun_s:.1f} s"
        raise Wrong(f"answered {spaced(answer[2])}")


class Closed(Wrong):
    """The server has closed the connection."""


class Silent(Wrong):
    """Neither an answer nor an end."""


def answering(server: Server, line: Line | None = None) -> None:
    """Make sure that a good request is answered, on a connection of its own or on `line`. Raises Wrong."""
    if line is None:
        with Line(server) as own:
            answering(server, own)
        return
    number = line.ask(PROBE)
    got, _, pdu = line.answer(server.patience_s)
    if got != number:
        raise Wrong(f"an answer to transaction {got:04x}h, which was not due")
    if not PROBE.allows(pdu):
        raise Wrong(f"a good read is answered {spaced(pdu)}")


def spaced(pdu: str) -> str:
    """Hex in pairs, not all of it where it is long."""
    return bytes.fromhex(pdu[:48]).hex(" ") + ("…" if len(pdu) > 48 else "")


def _connected(server: Server, source: str | None, buffers: dict[str, int]) -> socket.socket:
    family, kind, protocol, _, address = socket.getaddrinfo(
        server.host, server.port, type=socket.SOCK_STREAM
    )[0]
    made = socket.socket(family, kind, protocol)
    try:
        made.settimeout(max(server.patience_s, 2.0))
        for option, size in buffers.items():
            made.setsockopt(socket.SOL_SOCKET, getattr(socket, option), size)
        made.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        if source:
            made.bind((source, 0))
        made.connect(address)
    except OSError:
        made.close()
        raise
    return made
