"""Raw connection to the server under test, with time-outs."""

from __future__ import annotations

import itertools
import select
import socket
import struct
import time
from contextlib import suppress
from dataclasses import dataclass

from tests.hostile.case import CaseFailure, ModbusRequest, build_frame

PROBE = ModbusRequest("03 0000 0001", ("03 02 ....", "83 0[1-4]"))
#: Request and answer for the test pattern of the pneuforce register map, in the word order ABCD.
_TEST_PATTERN = ("03 0f00 0005", "030ac2f6e66612345678cfc7")
_RESET = struct.pack("ii", 1, 0)  # SO_LINGER: close with RST


@dataclass(frozen=True, slots=True)
class ServerUnderTest:
    """Address of the server, and its time-outs and limits."""

    host: str = "127.0.0.1"
    port: int = 5020
    unit: int = 1
    answer_timeout_s: float = 2.0  #: time to wait for an answer or for the end of the connection
    frame_timeout_s: float = 5.0  #: time after which the server closes a connection with an incomplete frame
    idle_timeout_s: float = 60.0
    max_connections: int = 64  #: connection limit of a pneuforce instrument
    is_pneuforce_server: bool = False

    def shows_test_pattern(self) -> bool:
        """Return True if the server contains the test pattern of the pneuforce register map."""
        with RawConnection(self) as connection:
            return connection.request(_TEST_PATTERN[0]) == _TEST_PATTERN[1]


class RawConnection:
    """One TCP connection. Bytes sent after the server has closed the connection are lost."""

    #: Transaction identifiers. Each identifier differs from the previous one.
    transactions = itertools.cycle(range(0x0101, 0xFFFF))

    def __init__(self, server: ServerUnderTest, source: str | None = None, **socket_options: int) -> None:
        """Connect, from the local address `source` if it is given. Raises CaseFailure."""
        self._server = server
        self._received = b""
        self.closed = False
        try:
            self.socket = _connect(server, source, socket_options)
        except OSError as error:
            raise CaseFailure(f"no connection: {error.strerror or error}") from None

    def __enter__(self) -> RawConnection:
        return self

    def __exit__(self, *_: object) -> None:
        self.socket.close()

    def reset(self) -> None:
        """Close the connection with RST instead of FIN."""
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _RESET)
        self.socket.close()

    def send(self, data: bytes) -> None:
        """Send bytes. Errors are ignored, because the server may have closed the connection."""
        with suppress(OSError):
            self.socket.sendall(data)

    def half_close(self) -> None:
        """Send FIN."""
        with suppress(OSError):
            self.socket.shutdown(socket.SHUT_WR)

    def send_request(self, request: ModbusRequest) -> int:
        """Send one request. Return its transaction identifier."""
        transaction, data = self.frame_of(request)
        self.send(data)
        return transaction

    def frame_of(self, request: ModbusRequest) -> tuple[int, bytes]:
        """Return the transaction identifier and the frame of a request."""
        transaction = next(self.transactions) if request.transaction is None else request.transaction
        unit = self._server.unit if request.unit is None else request.unit
        return transaction, build_frame(transaction, unit, bytes.fromhex(request.pdu))

    def request(self, pdu: str) -> str:
        """Send one request and return its answer, both as hex PDUs. Raises CaseFailure."""
        self.send_request(ModbusRequest(pdu, ()))
        return self.read_answer(self._server.answer_timeout_s)[2]

    def read_answer(self, within_s: float) -> tuple[int, int, str]:
        """Return transaction, unit and hex PDU of the next answer.

        Raises ConnectionClosed or NoAnswer, or CaseFailure if the bytes are not a Modbus frame.
        """
        until_s = time.monotonic() + within_s
        while not (frame := self._next_frame()):
            if self._receive(until_s):
                raise ConnectionClosed("cut short" if self._received else "closed")
        return frame

    def _next_frame(self) -> tuple[int, int, str] | None:
        if len(self._received) < 8:
            return None
        transaction, protocol, length, unit = struct.unpack_from(">HHHB", self._received)
        if protocol or not 3 <= length <= 254:
            raise CaseFailure(f"no Modbus frame: {self._received[:12].hex(' ')}")
        frame, rest = self._received[: 6 + length], self._received[6 + length :]
        if len(frame) < 6 + length:
            return None
        self._received = rest
        return transaction, unit, frame[7:].hex()

    def _receive(self, until_s: float) -> bool:
        """Receive bytes. Return True if the server has closed the connection. Raises NoAnswer."""
        if not self.is_readable(max(0.0, until_s - time.monotonic())):
            raise NoAnswer("silent, and open")
        try:
            data = self.socket.recv(65536)
        except OSError:
            data = b""
        self._received += data
        self.closed = not data
        return self.closed

    def is_readable(self, within_s: float) -> bool:
        """Return True if bytes or the end of the connection arrive within `within_s`."""
        return bool(select.select([self.socket], [], [], within_s)[0])

    def wait_closed(self, within_s: float) -> str:
        """Wait until the server closes the connection. Return how the connection was closed.

        Raises CaseFailure if the server answers instead, or NoAnswer if the connection stays open.
        """
        start_s = time.monotonic()
        try:
            answer = self.read_answer(within_s)
        except ConnectionClosed:
            return f"closed after {time.monotonic() - start_s:.1f} s"
        raise CaseFailure(f"answered {spaced(answer[2])}")


class ConnectionClosed(CaseFailure):
    """Error for a connection that the server has closed."""


class NoAnswer(CaseFailure):
    """Error for a server that neither answers nor closes the connection."""


def check_answers(server: ServerUnderTest, connection: RawConnection | None = None) -> None:
    """Raise CaseFailure if a valid request is not answered on `connection`, or on a new connection."""
    if connection is None:
        with RawConnection(server) as new_connection:
            check_answers(server, new_connection)
        return
    expected = connection.send_request(PROBE)
    transaction, _, pdu = connection.read_answer(server.answer_timeout_s)
    if transaction != expected:
        raise CaseFailure(f"an unexpected answer to transaction {transaction:04x}h")
    if not PROBE.allows(pdu):
        raise CaseFailure(f"a valid read is answered {spaced(pdu)}")


def spaced(pdu: str) -> str:
    """Return a hex PDU with spaces between the bytes. A long PDU is truncated."""
    return bytes.fromhex(pdu[:48]).hex(" ") + ("…" if len(pdu) > 48 else "")


def _connect(server: ServerUnderTest, source: str | None, socket_options: dict[str, int]) -> socket.socket:
    family, type_, protocol, _, address = socket.getaddrinfo(
        server.host, server.port, type=socket.SOCK_STREAM
    )[0]
    connected = socket.socket(family, type_, protocol)
    try:
        connected.settimeout(max(server.answer_timeout_s, 2.0))
        for option, size in socket_options.items():
            connected.setsockopt(socket.SOL_SOCKET, getattr(socket, option), size)
        connected.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        if source:
            connected.bind((source, 0))
        connected.connect(address)
    except OSError:
        connected.close()
        raise
    return connected
