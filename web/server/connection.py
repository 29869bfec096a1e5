"""HTTP connection of a browser: uvicorn's protocol class with timeouts and a connection limiter."""

from __future__ import annotations

import asyncio
import logging
import socket
import struct
import termios
import time
from fcntl import ioctl

from uvicorn.protocols.http.h11_impl import H11Protocol

from pneuforce.support.throttle import RateLimitedLogger
from pneuforce.web.server.connection_limiter import ConnectionLimiter
from pneuforce.web.server.eviction import Protection
from pneuforce.web.server.http_json import VENT_PATH

#: A connection is aborted if the client sends no request, or does not read the response, for this time.
IDLE_TIMEOUT_S = 10.0
STREAM_SEND_BUFFER_BYTES = 4096  #: small, because data in the buffer of the kernel becomes outdated
_ZERO_BYTES_UNREAD = bytes(4)
_LINGER_ZERO = struct.pack("ii", 1, 0)  #: value of SO_LINGER with which close() resets the connection

_log = RateLimitedLogger(logging.getLogger("pneuforce"), 60.0)


class HttpConnection(H11Protocol):
    """Connection that a limiter counts and can abort."""

    limiter: ConnectionLimiter  #: set by `connection_class`
    _is_stream = False
    _checked_cycle: object = None  #: the request that was in progress at the last idle check

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Register the connection with the limiter, which may abort the connection."""
        super().connection_made(transport)
        self._idle_timer = self.loop.call_later(IDLE_TIMEOUT_S, self._check_idle)
        self.limiter.admit(self)

    def connection_lost(self, exc: Exception | None) -> None:
        """Remove the connection from the limiter."""
        self._idle_timer.cancel()
        self.limiter.remove(self)
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Parse received bytes. An unexpected exception aborts this connection only."""
        try:
            super().data_received(data)
        except Exception:
            _log.warning(time.monotonic(), "web: connection aborted after an internal error", exc_info=True)
            self.transport.abort()
        self.limiter.update(self)

    def on_response_complete(self) -> None:
        """Handle the end of a response. The next request may already wait."""
        self._is_stream = False
        super().on_response_complete()
        self.limiter.update(self)

    def pause_writing(self) -> None:
        """Stop sending because the client does not read."""
        super().pause_writing()
        self.limiter.update(self)

    def resume_writing(self) -> None:
        """Send again because the client has read."""
        super().resume_writing()
        self.limiter.update(self)

    @property
    def protection(self) -> Protection:
        """Return the protection of the connection against eviction.

        The handler of a vent ignores the body. A vent therefore needs no complete body to be protected.
        """
        if self._is_stream:
            return Protection.FULL
        if not self._is_responding:
            head_expected = self.cycle is None or bool(self.conn.trailing_data[0])
            return Protection.LATER if head_expected else Protection.NONE
        if self.flow.write_paused:
            return Protection.NONE
        if self.cycle.scope["path"] == VENT_PATH:
            return Protection.FULL
        return Protection.NONE if self.cycle.more_body else Protection.LATER

    @property
    def _is_responding(self) -> bool:
        return self.cycle is not None and not self.cycle.response_complete

    @property
    def _socket(self) -> socket.socket:
        connected: socket.socket = self.transport.get_extra_info("socket")
        return connected

    @property
    def has_unread_bytes(self) -> bool:
        """Return True if bytes of the client wait in the socket."""
        fd = self._socket.fileno()
        return fd >= 0 and ioctl(fd, termios.FIONREAD, _ZERO_BYTES_UNREAD) != _ZERO_BYTES_UNREAD

    def start_streaming(self) -> None:
        """Configure the connection for an endless response whose data must not wait in buffers."""
        self._is_stream = True
        self.limiter.update(self)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, STREAM_SEND_BUFFER_BYTES)
        self.transport.set_write_buffer_limits(0)

    def discard_unsent(self) -> None:
        """Make the next close drop the data that the client has not read."""
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _LINGER_ZERO)

    def _check_idle(self) -> None:
        """Abort the connection if no request has arrived, or if one request is in progress at two checks.

        Event streams are not aborted.
        """
        sent_no_request = self.cycle is None
        is_stuck = self._is_responding and self.cycle is self._checked_cycle and not self._is_stream
        if sent_no_request or is_stuck:
            self.transport.abort()
            return
        self._checked_cycle = self.cycle
        self._idle_timer = self.loop.call_later(IDLE_TIMEOUT_S, self._check_idle)


def connection_class(limiter: ConnectionLimiter) -> type[HttpConnection]:
    """Return a class of connections that register with `limiter`."""
    return type("HttpConnection", (HttpConnection,), {"limiter": limiter})
