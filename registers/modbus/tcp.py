"""Modbus TCP over asyncio: sockets and time-outs; what is said over them is decided elsewhere."""

from __future__ import annotations

import asyncio
import logging
import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from registers.modbus.bank import Bank
from registers.modbus.codes import Code, exception
from registers.modbus.identity import Identity
from registers.modbus.log import SparingLog
from registers.modbus.mbap import Decoder, frame
from registers.modbus.pdu import Responder
from registers.source import Peer, Source

#: Read from one client before the next has its turn: some 40 requests, so that others wait little in a flood.
_CHUNK_BYTES = 512
#: Unit identifiers by which a TCP master may mean "whoever is at this address".
_ANY_UNIT = frozenset((0, 255))


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """How the server listens, answers, and when it gives a client up."""

    host: str = "127.0.0.1"
    port: int = 5020
    unit: int = 1
    word_swap: bool = False  #: low word of a 32-bit value first
    read_only: bool = False
    most_connections: int = 64  #: the next one is closed at once; the established ones stay
    idle_s: float = 60.0  #: without a byte from the client
    frame_s: float = 5.0  #: for a frame to be completed, and for a client to read its answers
    write_buffer_bytes: int = 65536  #: unread answers at which a client's requests are no longer read


@dataclass(slots=True)
class Counters:
    """What the server has seen since it was made."""

    clients: int = 0  #: connected now
    connections: int = 0  #: accepted
    turned_away: int = 0  #: closed at once, over the connection limit
    requests: int = 0
    exceptions: int = 0  #: requests answered with an exception code
    refused_frames: int = 0  #: headers or functions that no request has; each closed its connection
    timeouts: int = 0  #: connections closed for being idle, unfinished or not reading


class ModbusTcpServer:
    """One source on one TCP port."""

    def __init__(
        self,
        source: Source,
        options: Options,
        identity: Mapping[int, str],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.options = options
        self.counters = Counters()
        self.clock = clock
        self.units = _ANY_UNIT | {options.unit}
        self.log = SparingLog(logging.getLogger(__name__))
        bank = Bank(word_swap=options.word_swap)
        self.responder = Responder(bank, source, Identity(identity), read_only=options.read_only)
        self.connections: set[_Connection] = set()
        self._server: asyncio.Server | None = None
        self._sweep: asyncio.TimerHandle | None = None

    async def start(self) -> None:
        """Listen. Raises OSError where the address cannot be had."""
        loop = asyncio.get_running_loop()
        self._server = await loop.create_server(
            lambda: _Connection(self), self.options.host, self.options.port, backlog=128
        )
        self._sweep_every(min(self.options.frame_s, self.options.idle_s, 2.0) / 4)

    @property
    def port(self) -> int:
        """The port that is listened on; differs from the option where that is 0."""
        assert self._server is not None
        port: int = self._server.sockets[0].getsockname()[1]
        return port

    def close(self) -> None:
        """Stop listening and close every connection, once what its client reads has been sent."""
        if self._server is None or self._sweep is None:
            return
        self._sweep.cancel()
        self._server.close()
        for connection in list(self.connections):
            connection.close()

    def _sweep_every(self, period_s: float) -> None:
        """Close the connections whose time is up, now and every `period_s`."""
        now_s = self.clock()
        for connection in list(self.connections):
            connection.close_if_overdue(now_s)
        self._sweep = asyncio.get_running_loop().call_later(period_s, self._sweep_every, period_s)


class _Connection(asyncio.BufferedProtocol):
    """One client. asyncio sets TCP_NODELAY on its socket, and sends FIN behind the last answer."""

    def __init__(self, server: ModbusTcpServer) -> None:
        self._server = server
        self._options = server.options
        self._decoder = Decoder()
        self._buffer = memoryview(bytearray(_CHUNK_BYTES))
        self._heard_s = server.clock()
        self._frame_begun_s = math.inf
        self._unread_s = math.inf  #: since when answers wait for a client that does not read

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        self._peer = Peer("modbus_tcp", str((transport.get_extra_info("peername") or ("",))[0]))
        server = self._server
        if len(server.connections) >= self._options.most_connections:
            server.counters.turned_away += 1
            self._say("turned away: %d clients are connected", len(server.connections))
            transport.abort()
            return
        transport.set_write_buffer_limits(high=self._options.write_buffer_bytes)
        server.connections.add(self)
        server.counters.connections += 1
        server.counters.clients += 1

    def get_buffer(self, sizehint: int) -> memoryview:  # noqa: ARG002
        return self._buffer

    def buffer_updated(self, nbytes: int) -> None:
        """Answer every request that the received bytes complete, in one write."""
        now_s = self._heard_s = self._server.clock()
        was_unfinished = self._decoder.unfinished
        requests = self._decoder.feed(bytes(self._buffer[:nbytes]))
        if not self._decoder.unfinished:
            self._frame_begun_s = math.inf
        elif requests or not was_unfinished:
            self._frame_begun_s = now_s
        answers = []
        for transaction, unit, pdu in requests:
            answer = self._answer(unit, pdu, now_s)
            if answer is None:
                break
            answers.append(frame(transaction, unit, answer))
        if answers:
            self._transport.write(b"".join(answers))
        if len(answers) < len(requests):
            self._refuse(f"function {requests[len(answers)].pdu[0]:02X}h")
        elif self._decoder.broken:
            self._refuse(self._decoder.broken)

    def _answer(self, unit: int, pdu: bytes, now_s: float) -> bytes | None:
        if unit in self._server.units:
            answer = self._server.responder.answer(pdu, self._peer, now_s)
        else:
            answer = exception(pdu[0], Code.NO_SUCH_UNIT)
        if answer is not None:
            counters = self._server.counters
            counters.requests += 1
            counters.exceptions += answer[0] >= 0x80
        return answer

    def _refuse(self, why: str) -> None:
        self._server.counters.refused_frames += 1
        self._say("closed: %s", why)
        self.close()

    def eof_received(self) -> bool:
        self.close()
        return False

    def pause_writing(self) -> None:
        """The client does not read its answers: its requests wait in its own buffers from now on."""
        self._unread_s = self._server.clock()
        self._transport.pause_reading()

    def resume_writing(self) -> None:
        if not self._transport.is_closing():
            self._unread_s = math.inf
            self._transport.resume_reading()

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002
        if self in self._server.connections:
            self._server.connections.remove(self)
            self._server.counters.clients -= 1

    def close(self) -> None:
        """Send what is left, then FIN; a client that does not read has `frame_s` for it."""
        self._unread_s = min(self._unread_s, self._server.clock())
        self._transport.close()

    def close_if_overdue(self, now_s: float) -> None:
        """Close where the client does not read, leaves a frame unfinished, or says nothing."""
        if now_s - self._unread_s > self._options.frame_s:
            self._time_out("its answers are not read")
            self._transport.abort()
        elif self._transport.is_closing():
            return
        elif now_s - self._frame_begun_s > self._options.frame_s:
            self._time_out("a frame is left unfinished")
        elif now_s - self._heard_s > self._options.idle_s:
            self._time_out("idle")

    def _time_out(self, why: str) -> None:
        self._server.counters.timeouts += 1
        self._say("closed: %s", why)
        self.close()

    def _say(self, message: str, *facts: object) -> None:
        self._server.log.say(self._server.clock(), f"client %s {message}", self._peer.address, *facts)
