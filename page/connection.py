"""One connection of a browser, as uvicorn serves it, and bounded."""

from __future__ import annotations

import asyncio
import logging
import time

from uvicorn.protocols.http.h11_impl import H11Protocol

from page.crowd import Crowd
from registers.sparing_log import SparingLog

FIRST_REQUEST_S = 10.0

_say = SparingLog(logging.getLogger("pneuforce"), 60.0).say


class Connection(H11Protocol):
    """A connection that belongs to a crowd."""

    crowd: Crowd  #: set by `in_crowd`
    streams = False

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Join the crowd, which may cut it off."""
        super().connection_made(transport)
        self._silence = self.loop.call_later(FIRST_REQUEST_S, self._cut_off_if_silent)
        self.crowd.join(self)

    def connection_lost(self, exc: Exception | None) -> None:
        """Leave the crowd."""
        self._silence.cancel()
        self.crowd.leave(self)
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Take bytes; what HTTP cannot be read from them costs this connection."""
        try:
            super().data_received(data)
        except Exception:
            _say(time.monotonic(), "page: a connection was cut off after an error of ours", trace=True)
            self.transport.abort()

    def _cut_off_if_silent(self) -> None:
        if not self.cycle:
            self.transport.abort()


def in_crowd(crowd: Crowd) -> type[Connection]:
    """The kind of connection that joins `crowd`."""
    return type("Connection", (Connection,), {"crowd": crowd})
