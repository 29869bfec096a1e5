"""HTTPS connection of a browser. For the limiter, a handshake is an incomplete request head.

A client that begins without TLS is served over plain HTTP, where `plain_http.py` decides what it may read.
"""

from __future__ import annotations

import asyncio
import logging
import ssl
import time

from pneuforce.support.renewed_context import RenewedContext
from pneuforce.support.throttle import RateLimitedLogger
from pneuforce.support.tls_failure import tls_failure_reason
from pneuforce.web.server.connection import HttpConnection
from pneuforce.web.server.connection_limiter import ConnectionLimiter
from pneuforce.web.server.tls_transport import TlsTransport

HANDSHAKE_TIMEOUT_S = 5.0
_HANDSHAKE_RECORD = 22  # first byte of each handshake (RFC 8446, section 5.1); no HTTP method begins with it

_log = RateLimitedLogger(logging.getLogger("pneuforce"), 60.0)


class HttpsConnection(HttpConnection):
    """Connection that a limiter counts from its start, before the handshake."""

    tls: RenewedContext  #: set by `https_connection_class`
    _has_begun = False

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Register the connection with the limiter. Abort the connection without a handshake in time."""
        self._secured = TlsTransport(transport)
        self._handshake_timer = self.loop.call_later(HANDSHAKE_TIMEOUT_S, transport.abort)
        super().connection_made(self._secured)

    def connection_lost(self, exc: Exception | None) -> None:
        """Remove the connection from the limiter."""
        self._handshake_timer.cancel()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Decrypt received bytes, and parse them as HTTP."""
        if not self._has_begun:
            self._begin(is_tls=data[0] == _HANDSHAKE_RECORD)
        try:
            decrypted = self._secured.receive(data)
        except ssl.SSLError as error:
            self._log_failure(error)
            self._secured.close()
            return
        if self._secured.is_secure:
            self._handshake_timer.cancel()
        if decrypted:
            super().data_received(decrypted)
        if self._secured.is_ended:
            self._secured.close()

    def _begin(self, *, is_tls: bool) -> None:
        self._has_begun = True
        self.scheme = "https" if is_tls else "http"
        if is_tls:
            self._secured.begin(self.tls.current)
        else:
            self._handshake_timer.cancel()

    def _log_failure(self, error: ssl.SSLError) -> None:
        what = "connection" if self._secured.is_secure else "handshake"
        address = self.client[0] if self.client else "an unknown address"
        text = "web: TLS %s of %s failed: %s"
        _log.warning(time.monotonic(), text, what, address, tls_failure_reason(error))


def https_connection_class(limiter: ConnectionLimiter, tls: RenewedContext) -> type[HttpsConnection]:
    """Return a class of connections that register with `limiter` and use the certificate of `tls`."""
    return type("HttpsConnection", (HttpsConnection,), {"limiter": limiter, "tls": tls})
