"""Connection of one Modbus TCP client: decodes requests, sends answers, closes on errors and time-outs."""

from __future__ import annotations

import asyncio
import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

from pneuforce.registers.modbus.eviction import RequestRhythm
from pneuforce.registers.modbus.exception_codes import ExceptionCode, exception_response
from pneuforce.registers.modbus.mbap import MbapDecoder, MbapRequest, encode_frame
from pneuforce.registers.modbus.pdu import FIRST_EXCEPTION_FUNCTION, RequestHandler
from pneuforce.registers.modbus.round_robin import RoundRobinScheduler
from pneuforce.registers.source import Peer

#: Maximum size of one read: about 40 requests. These requests are answered before the next read.
_READ_BYTES = 512


@dataclass(slots=True)
class ModbusTcpCounters:
    """Event counters of the server since its start."""

    clients: int = 0  #: connections that are open now
    connections: int = 0  #: accepted connections
    not_allowed: int = 0  #: connections closed because of their address; not included in any other counter
    evicted: int = 0  #: connections closed because a new connection exceeded the limit
    requests: int = 0
    exceptions: int = 0  #: requests answered with an exception code
    invalid_frames: int = 0  #: invalid headers and functions; each of them closed its connection
    timeouts: int = 0  #: connections closed because of an idle client, an incomplete frame or unread answers


class ConnectionLimits(Protocol):
    """Limits of one connection."""

    @property
    def idle_timeout_s(self) -> float:
        """Return the time without a byte from the client after which the connection is closed."""
        ...

    @property
    def frame_timeout_s(self) -> float:
        """Return the time limit for a complete frame, and for the client to read its answers."""
        ...

    @property
    def write_buffer_bytes(self) -> int:
        """Return the number of unread answer bytes above which requests are no longer read."""
        ...


class ConnectionOwner(Protocol):
    """Part of the server that a connection uses."""

    clock: Callable[[], float]
    counters: ModbusTcpCounters
    units: frozenset[int]  #: unit identifiers of the instrument; requests to other units are rejected
    request_handler: RequestHandler
    scheduler: RoundRobinScheduler

    @property
    def limits(self) -> ConnectionLimits:
        """Return the limits of each connection."""
        ...

    def admit(self, connection: ModbusTcpConnection) -> None:
        """Register a new connection, or close it if its address is not allowed."""
        ...

    def remove(self, connection: ModbusTcpConnection) -> None:
        """Unregister a connection. Unknown connections are ignored."""
        ...

    def log_warning(self, message: str, *args: object) -> None:
        """Log a rate-limited warning."""
        ...


class ModbusTcpConnection(asyncio.BufferedProtocol):
    """Connection of one client. asyncio sets TCP_NODELAY, and sends FIN after the last answer."""

    def __init__(self, server: ConnectionOwner) -> None:
        self._server = server
        self._request_handler = server.request_handler
        self._limits = server.limits
        self._decoder = MbapDecoder()
        self._buffer = memoryview(bytearray(_READ_BYTES))
        self._pending: deque[MbapRequest] = deque()  #: complete requests that are not answered yet
        self._answers: list[bytes] = []  #: answers to send at the end of this pass of the event loop
        self._error = ""  #: error after which the connection closes; empty if there is none
        self._eof = False  #: the client will send no more requests
        self.last_received_s = server.clock()
        self.rhythm = RequestRhythm()
        self.requests = 0
        self.exceptions = 0  #: requests answered with an exception code
        self._frame_started_s = math.inf
        self._unread_since_s = math.inf  #: time at which unread answers began to wait; infinite if none wait
        self._timed_out = False  #: a time-out of this connection has been counted

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Register the connection with the server."""
        assert isinstance(transport, asyncio.Transport)
        self._set_transport(transport)
        self._peer = Peer("modbus_tcp", str((transport.get_extra_info("peername") or ("",))[0]))
        self._server.admit(self)

    def _set_transport(self, transport: asyncio.Transport) -> None:
        self._transport = transport
        transport.set_write_buffer_limits(high=self._limits.write_buffer_bytes)

    @property
    def address(self) -> str:
        """Return the IP address of the client."""
        return self._peer.address

    def health(self, now_s: float) -> dict[str, Any]:
        """Return the client and its counters, for the web page."""
        return {
            "address": self.address,
            "requests": self.requests,
            "exceptions": self.exceptions,
            "age_s": round(now_s - self.last_received_s, 3),
        }

    def evict(self, new_address: str) -> None:
        """Close immediately, to make room for a connection from `new_address`."""
        self._log_warning(
            "closed to make room for a connection from %s: the limit of %d connections is reached",
            new_address,
            self._server.counters.clients,
        )
        self._server.remove(self)
        self._transport.abort()

    def reject(self) -> None:
        """Close immediately, because the address of the client is not allowed."""
        self._log_warning("rejected: its address is not in the list of allowed addresses")
        self._transport.abort()

    def get_buffer(self, sizehint: int) -> memoryview:  # noqa: ARG002
        """Return the buffer for the next received bytes."""
        return self._buffer

    def buffer_updated(self, nbytes: int) -> None:
        """Queue the requests that the received bytes complete."""
        now_s = self.last_received_s = self._server.clock()
        was_incomplete, had_pending = self._decoder.is_incomplete, bool(self._pending)
        requests = self._decoder.feed(bytes(self._buffer[:nbytes]))
        if not self._decoder.is_incomplete:
            self._frame_started_s = math.inf
        elif requests or not was_incomplete:
            self._frame_started_s = now_s
        self._error = self._decoder.error
        self._pending += requests
        if requests:
            self.rhythm.add(now_s)
        if not self._pending:
            self._continue_or_close()
        elif not had_pending:
            self._server.scheduler.add(self)

    def answer_next(self, now_s: float) -> bool:
        """Answer the next pending request. Return True if more requests are pending."""
        transaction, unit, pdu = self._pending.popleft()
        answer = self._answer(unit, pdu, now_s)
        if answer is None:
            self._error = f"function {pdu[0]:02X}h"
            self._pending.clear()
        else:
            self._answers.append(encode_frame(transaction, unit, answer))
        return bool(self._pending)

    def send_answers(self) -> None:
        """Send the answers of this pass in one write."""
        answers, self._answers = self._answers, []
        if self._transport.is_closing():
            return
        if answers:
            self._transport.write(b"".join(answers))
        if not self._pending:
            self._continue_or_close()

    def pause_reading(self) -> None:
        """Stop reading from the client until every pending request has been answered."""
        self._transport.pause_reading()

    def _continue_or_close(self) -> None:
        """Close after an error or end of input, else continue to read. Call only without pending requests."""
        if self._error:
            self._server.counters.invalid_frames += 1
            self._log_warning("closed: invalid %s", self._error)
            self.close()
        elif self._eof:
            self.close()
        elif self._unread_since_s == math.inf:
            self._transport.resume_reading()

    def _answer(self, unit: int, pdu: bytes, now_s: float) -> bytes | None:
        # An invalid function closes the connection, even if it is addressed to another unit.
        if unit in self._server.units or pdu[0] >= FIRST_EXCEPTION_FUNCTION:
            answer = self._request_handler.answer(pdu, self._peer, now_s)
        else:
            answer = exception_response(pdu[0], ExceptionCode.NO_SUCH_UNIT)
        if answer is not None:
            is_exception = answer[0] >= FIRST_EXCEPTION_FUNCTION
            for counters in (self, self._server.counters):
                counters.requests += 1
                counters.exceptions += is_exception
        return answer

    def eof_received(self) -> bool:
        """Return True, so that the connection stays open until the last request has been answered."""
        self._eof = True
        if not self._pending:
            self._continue_or_close()
        return True

    def pause_writing(self) -> None:
        """Stop reading requests, because the client does not read its answers."""
        self._unread_since_s = self._server.clock()
        self._transport.pause_reading()

    def resume_writing(self) -> None:
        """Read requests again, because the client reads its answers again."""
        if not self._transport.is_closing():
            self._unread_since_s = math.inf
            if self._decoder.is_incomplete:  # nothing was read: the client could not complete the frame
                self._frame_started_s = self._server.clock()
            if not self._pending:
                self._transport.resume_reading()

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002
        """Unregister the connection."""
        self._server.remove(self)

    def close(self) -> None:
        """Send the remaining answers, then FIN. The client must read them within `frame_timeout_s`."""
        self._unread_since_s = min(self._unread_since_s, self._server.clock())
        self._transport.close()

    def close_if_timed_out(self, now_s: float) -> None:
        """Close if the client does not read its answers, leaves a frame incomplete, or is idle."""
        if now_s - self._unread_since_s > self._limits.frame_timeout_s:
            self._close_after_timeout("the client does not read its answers")
            self._transport.abort()
        elif self._transport.is_closing() or self._unread_since_s < math.inf:
            return
        elif now_s - self._frame_started_s > self._limits.frame_timeout_s:
            self._close_after_timeout("incomplete frame")
        elif now_s - self.last_received_s > self._limits.idle_timeout_s:
            self._close_after_timeout("idle")

    def _close_after_timeout(self, reason: str) -> None:
        if not self._timed_out:
            self._timed_out = True
            self._server.counters.timeouts += 1
            self._log_warning("closed: %s", reason)
        self.close()

    def _log_warning(self, message: str, *args: object) -> None:
        self._server.log_warning(f"client %s {message}", self._peer.address, *args)
