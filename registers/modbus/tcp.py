"""Modbus TCP over asyncio: sockets and time-outs; what is said over them is decided elsewhere."""

from __future__ import annotations

import asyncio
import logging
import math
import time
from collections import Counter, deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from registers.modbus.allow import AllowList
from registers.modbus.bank import Bank
from registers.modbus.codes import Code, exception
from registers.modbus.identity import Identity
from registers.modbus.log import SparingLog
from registers.modbus.mbap import Decoder, Request, frame
from registers.modbus.pdu import Responder
from registers.modbus.turns import Turns
from registers.source import Peer, Source

#: Read from one client at a time: some 40 requests, which are answered before it is read on.
_CHUNK_BYTES = 512
#: Unit identifiers by which a TCP master may mean "whoever is at this address".
_ANY_UNIT = frozenset((0, 255))


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """How the server listens, answers, and when it gives a client up."""

    host: str = "127.0.0.1"
    port: int = 5020
    allow: tuple[str, ...] = ()  #: addresses and networks that may connect; all, where empty
    unit: int = 1
    word_swap: bool = False  #: low word of a 32-bit value first
    read_only: bool = False
    most_connections: int = 64  #: the next one is accepted, and another closed: see ModbusTcpServer
    idle_s: float = 60.0  #: without a byte from the client
    frame_s: float = 5.0  #: for a frame to be completed, and for a client to read its answers
    write_buffer_bytes: int = 65536  #: unread answers at which a client's requests are no longer read


@dataclass(slots=True)
class Counters:
    """What the server has seen since it was made."""

    clients: int = 0  #: connected now
    connections: int = 0  #: accepted
    foreign: int = 0  #: closed at once, for their address may not connect; counted nowhere else
    evicted: int = 0  #: closed to make room for a newcomer, over the connection limit
    requests: int = 0
    exceptions: int = 0  #: requests answered with an exception code
    refused_frames: int = 0  #: headers or functions that no request has; each closed its connection
    timeouts: int = 0  #: connections closed for being idle, unfinished or not reading


class ModbusTcpServer:
    """One source on one TCP port.

    Whoever may connect is accepted, for it may want to vent. Where that is over the connection limit, the
    address with most connections (the newcomer counted with its own) loses the one that was silent for
    longest, never the newcomer: a flood from one address evicts nobody but itself.
    """

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
        self._allowed = AllowList(options.allow)
        bank = Bank(word_swap=options.word_swap)
        self.responder = Responder(bank, source, Identity(identity), read_only=options.read_only)
        self.turns = Turns(clock)
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

    def admit(self, newcomer: _Connection) -> None:
        """Count a connection in; over the limit, close another one. Close it where it may not connect."""
        if not self._allowed.admits(newcomer.address):
            self.counters.foreign += 1
            newcomer.turn_away()
            return
        if len(self.connections) >= self.options.most_connections:
            held = Counter(c.address for c in (*self.connections, newcomer))
            self.counters.evicted += 1
            max(self.connections, key=lambda c: (held[c.address], -c.heard_s)).evict(newcomer.address)
        self.connections.add(newcomer)
        self.counters.connections += 1
        self.counters.clients += 1

    def count_out(self, connection: _Connection) -> None:
        """Forget a connection that is gone; once is enough."""
        if connection in self.connections:
            self.connections.remove(connection)
            self.counters.clients -= 1

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
        self._requests: deque[Request] = deque()  #: received; whole ones are carried out whatever happens
        self._answers: list[bytes] = []  #: of this pass of the loop
        self._wrong = ""  #: why to close, behind the last answer
        self._ended = False  #: the client sends no more
        self.heard_s = server.clock()
        self._frame_begun_s = math.inf
        self._unread_s = math.inf  #: since when answers wait for a client that does not read

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        self._peer = Peer("modbus_tcp", str((transport.get_extra_info("peername") or ("",))[0]))
        transport.set_write_buffer_limits(high=self._options.write_buffer_bytes)
        self._server.admit(self)

    @property
    def address(self) -> str:
        """Whose it is."""
        return self._peer.address

    def evict(self, newcomer: str) -> None:
        """Close at once, for a newcomer."""
        self._say("evicted for one of %s: %d are connected", newcomer, len(self._server.connections))
        self._server.count_out(self)
        self._transport.abort()

    def turn_away(self) -> None:
        """Close at once, unread."""
        self._say("turned away: not in the list of those that may connect")
        self._transport.abort()

    def get_buffer(self, sizehint: int) -> memoryview:  # noqa: ARG002
        return self._buffer

    def buffer_updated(self, nbytes: int) -> None:
        """Queue the requests that the received bytes complete."""
        now_s = self.heard_s = self._server.clock()
        was_unfinished, had_requests = self._decoder.unfinished, bool(self._requests)
        requests = self._decoder.feed(bytes(self._buffer[:nbytes]))
        if not self._decoder.unfinished:
            self._frame_begun_s = math.inf
        elif requests or not was_unfinished:
            self._frame_begun_s = now_s
        self._wrong = self._decoder.broken
        self._requests += requests
        if not self._requests:
            self._go_on()
        elif not had_requests:
            self._server.turns.join(self)

    def take_turn(self, now_s: float) -> bool:
        """Answer the next request; whether more are waiting."""
        transaction, unit, pdu = self._requests.popleft()
        answer = self._answer(unit, pdu, now_s)
        if answer is None:
            self._wrong = f"function {pdu[0]:02X}h"
            self._requests.clear()
        else:
            self._answers.append(frame(transaction, unit, answer))
        return bool(self._requests)

    def end_pass(self) -> None:
        """Send the answers of this pass in one write."""
        answers, self._answers = self._answers, []
        if self._transport.is_closing():
            return
        if answers:
            self._transport.write(b"".join(answers))
        if not self._requests:
            self._go_on()

    def hold(self) -> None:
        """Read nothing more until every request has been answered."""
        self._transport.pause_reading()

    def _go_on(self) -> None:
        """No request is left: close where there can be no other, else read on."""
        if self._wrong:
            self._refuse(self._wrong)
        elif self._ended:
            self.close()
        elif self._unread_s == math.inf:
            self._transport.resume_reading()

    def _answer(self, unit: int, pdu: bytes, now_s: float) -> bytes | None:
        if unit in self._server.units or pdu[0] >= 0x80:  # no request's, whoever is meant
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
        """Whether to keep the connection: until the last request has been answered."""
        self._ended = True
        if not self._requests:
            self._go_on()
        return True

    def pause_writing(self) -> None:
        """The client does not read its answers: its requests wait in its own buffers from now on."""
        self._unread_s = self._server.clock()
        self._transport.pause_reading()

    def resume_writing(self) -> None:
        if not self._transport.is_closing():
            self._unread_s = math.inf
            if not self._requests:
                self._transport.resume_reading()

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002
        self._server.count_out(self)

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
        elif now_s - self.heard_s > self._options.idle_s:
            self._time_out("idle")

    def _time_out(self, why: str) -> None:
        self._server.counters.timeouts += 1
        self._say("closed: %s", why)
        self.close()

    def _say(self, message: str, *facts: object) -> None:
        self._server.log.say(self._server.clock(), f"client %s {message}", self._peer.address, *facts)
