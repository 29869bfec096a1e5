"""HTTP server on uvicorn, for the page of an instrument and for the overview."""

from __future__ import annotations

import logging
from types import FrameType

from starlette.types import ASGIApp
from uvicorn import Config, Server

from pneuforce.support.renewed_context import RenewedContext
from pneuforce.web.server.connection import connection_class
from pneuforce.web.server.connection_limiter import ConnectionLimiter
from pneuforce.web.server.https_connection import https_connection_class
from pneuforce.web.server.listener import ACCEPTS_PER_ROUND


class WebServer(Server):
    """uvicorn server that stops at once, without waiting for open event streams."""

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:  # noqa: ARG002
        """Stop after SIGINT or SIGTERM."""
        self.stop()

    def stop(self) -> None:
        """Stop serving."""
        self.should_exit = self.force_exit = True


def web_server(app: ASGIApp, limiter: ConnectionLimiter, tls: RenewedContext | None) -> WebServer:
    """Return the server of an application: HTTPS with a certificate, otherwise HTTP."""
    return WebServer(
        Config(
            app,
            http=connection_class(limiter) if tls is None else https_connection_class(limiter, tls),
            ws="none",
            lifespan="off",
            proxy_headers=False,  # a client could forge its address with X-Forwarded-For
            server_header=False,
            access_log=False,
            log_config=None,
            backlog=ACCEPTS_PER_ROUND,
            log_level=logging.CRITICAL,  # malformed requests of clients must not fill the log
        )
    )
