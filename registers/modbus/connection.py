"""One client of Modbus TCP: its bytes in, its answers out, and when it is given up."""

from __future__ import annotations

import asyncio
import math
from collections import deque
from typing import TYPE_CHECKING

from registers.modbus.codes import Code, exception
from registers.modbus.mbap import Decoder, Request, frame
from registers.source import Peer

if TYPE_CHECKING:
    from registers.modbus.tcp import ModbusTcpServer

#: Read from one client at a time: some 40 requests, which are answered before it is read on.
_CHUNK_BYTES = 512


class Connection(asyncio.BufferedProtocol):
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
        self.requests = 0
        self.exceptions = 0  #: of them, answered with an exception code
        self._frame_begun_s = math.inf
        self._unread_s = math.inf  #: since when answers wait for a client that does not read

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Let the server admit the client."""
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
        """Where the next bytes go."""
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
            wrong = answer[0] >= 0x80
            for counters in (self, self._server.counters):
                counters.requests += 1
                counters.exceptions += wrong
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
        """The client reads again: so are its requests."""
        if not self._transport.is_closing():
            self._unread_s = math.inf
            if not self._requests:
                self._transport.resume_reading()

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002
        """The connection is gone, whoever ended it."""
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
