"""HTTP server of the overview: the page at /, the same data at /api/instruments."""

from __future__ import annotations

import asyncio
import socket
import time
from collections.abc import Sequence

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp

from pneuforce.support.renewed_context import RenewedContext
from pneuforce.web.app import STATIC
from pneuforce.web.overview.rows import page, row
from pneuforce.web.overview.watched_instrument import WatchedInstrument
from pneuforce.web.plain_http import PlainHttp
from pneuforce.web.request_guard import RequestGuard
from pneuforce.web.server.connection_limiter import ConnectionLimiter
from pneuforce.web.server.http_json import json_response
from pneuforce.web.server.web_server import web_server


def overview_app(instruments: Sequence[WatchedInstrument], *, is_https: bool = False) -> ASGIApp:
    """Return the ASGI application of an HTTP or an HTTPS server."""

    async def overview(request: Request) -> Response:
        now_s = time.monotonic()
        return HTMLResponse(page((row(each, now_s) for each in instruments), request.url.hostname or ""))

    async def data(_request: Request) -> Response:
        now_s = time.monotonic()
        return json_response({"instruments": [row(each, now_s) for each in instruments]})

    routes = [
        Route("/", overview),
        Route("/api/instruments", data),
        Mount("/static", StaticFiles(directory=STATIC, check_dir=False)),
    ]
    app = Starlette(routes=routes)
    return RequestGuard(PlainHttp(app) if is_https else app)


async def serve_overview(
    instruments: Sequence[WatchedInstrument],
    allow: Sequence[str],
    listener: socket.socket,
    tls: RenewedContext | None = None,
) -> None:
    """Serve until SIGINT or SIGTERM, over HTTPS with a certificate.

    Raises ValueError for an invalid item of `allow`.
    """
    app = overview_app(instruments, is_https=tls is not None)
    server = web_server(app, ConnectionLimiter(allow), tls)
    async with asyncio.TaskGroup() as group:
        endless = [each.run() for each in instruments] + ([tls.follow()] if tls else [])
        tasks = [group.create_task(each) for each in endless]
        await server.serve([listener])
        for task in tasks:
            task.cancel()
