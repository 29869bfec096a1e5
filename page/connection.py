"""One connection of a browser, as uvicorn serves it, and bounded."""

from __future__ import annotations

import asyncio
import logging
import socket
import struct
import termios
import time
from fcntl import ioctl

from uvicorn.protocols.http.h11_impl import H11Protocol

from page.crowd import Crowd
from registers.sparing_log import SparingLog

PATIENCE_S = 10.0  #: with one that asks nothing, or does not take its answer
SEND_BUFFER = 4096  #: of a stream: what lies there grows old
NO_BYTES = bytes(4)
AT_ONCE = struct.pack("ii", 1, 0)  #: a close that resets the connection

_say = SparingLog(logging.getLogger("pneuforce"), 60.0).say


class Connection(H11Protocol):
    """A connection that belongs to a crowd."""

    crowd: Crowd  #: set by `in_crowd`
    _streams = False
    _known: object = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Join the crowd, which may cut it off."""
        super().connection_made(transport)
        self._patience = self.loop.call_later(PATIENCE_S, self._lose_patience)
        self.crowd.join(self)

    def connection_lost(self, exc: Exception | None) -> None:
        """Leave the crowd."""
        self._patience.cancel()
        self.crowd.leave(self)
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Take bytes; what HTTP cannot be read from them costs this connection."""
        try:
            super().data_received(data)
        except Exception:
            _say(time.monotonic(), "page: a connection was cut off after an error of ours", trace=True)
            self.transport.abort()

    @property
    def busy(self) -> bool:
        """Whether a request is under way here, or has come and is to be read."""
        return self._answering or self._unread

    @property
    def _answering(self) -> bool:
        return self.cycle is not None and not self.cycle.response_complete

    @property
    def _unread(self) -> bool:
        own = self.transport.get_extra_info("socket")
        return own.fileno() >= 0 and ioctl(own.fileno(), termios.FIONREAD, NO_BYTES) != NO_BYTES

    def stream(self) -> None:
        """Its answer has no end, and is not to lie anywhere on its way: what is shown is to be new."""
        self._streams = True
        own = self.transport.get_extra_info("socket")
        own.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)
        self.transport.set_write_buffer_limits(0)

    def forget(self) -> None:
        """What was not taken yet is not to arrive any more."""
        own = self.transport.get_extra_info("socket")
        own.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, AT_ONCE)

    def _lose_patience(self) -> None:
        silent = self.cycle is None
        stuck = self._answering and self.cycle is self._known and not self._streams
        if silent or stuck:
            self.transport.abort()
            return
        self._known = self.cycle
        self._patience = self.loop.call_later(PATIENCE_S, self._lose_patience)


def in_crowd(crowd: Crowd) -> type[Connection]:
    """The kind of connection that joins `crowd`."""
    return type("Connection", (Connection,), {"crowd": crowd})
