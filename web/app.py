"""HTTP routes of the web server."""

from __future__ import annotations

import logging
import time
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from http import HTTPStatus
from pathlib import Path
from typing import Any

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.middleware import Middleware
from starlette.middleware.gzip import GZipMiddleware
from starlette.requests import Request
from starlette.responses import FileResponse, Response, StreamingResponse
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp, Receive, Scope, Send

from pneuforce.registers.rdt.sensor_pages import SENSOR_PAGES
from pneuforce.support.printable import printable
from pneuforce.support.renewed_context import RenewedContext
from pneuforce.support.throttle import RateLimitedLogger
from pneuforce.web.browser_feed import BrowserFeed
from pneuforce.web.earlier_events import EarlierEvents
from pneuforce.web.event_stream import MAX_STREAMS, EventBroadcaster, EventStream, StreamOwner
from pneuforce.web.health import HEALTH_PATH, health_routes
from pneuforce.web.inspector import can_frames, register_blocks
from pneuforce.web.instrument_client import InstrumentClient
from pneuforce.web.instrument_info import instrument_info
from pneuforce.web.login.login import Logins
from pneuforce.web.login_routes import LoginRoutes
from pneuforce.web.metrics import metrics_text, reading_of
from pneuforce.web.page_recorder import PageRecorder
from pneuforce.web.plain_http import PlainHttp
from pneuforce.web.plain_page import (
    VENT_STATE_PATH,
    error_answer,
    vent_state_page,
)
from pneuforce.web.recording_routes import RecordingRoutes
from pneuforce.web.request_guard import RequestGuard
from pneuforce.web.server.client_network import client_network
from pneuforce.web.server.connection_limiter import ClientAddress, ConnectionLimiter
from pneuforce.web.server.http_json import (
    VENT_PATH,
    HttpRequestError,
    error_response,
    json_response,
)
from pneuforce.web.server.request_pacer import RequestPacer
from pneuforce.web.write_routes import WriteRoutes

STATIC = Path(__file__).parent / "static"
#: Paths that an HTTPS server also serves without TLS: clients of ATI sensors know no HTTPS. Nothing, for
#: example an expired certificate, may prevent a vent. Load balancers take a redirection for a healthy answer.
PLAIN_HTTP_PATHS = frozenset((*SENSOR_PAGES, VENT_PATH, HEALTH_PATH))
STATUS_TEXTS = {
    HTTPStatus.NOT_FOUND: "This address does not exist.",
    HTTPStatus.METHOD_NOT_ALLOWED: "This address does not support the method of the request.",
}

_log = RateLimitedLogger(logging.getLogger("pneuforce"), 60.0)
#: Middleware of the files and texts that a browser loads once: 360 kB, and 115 kB after compression.
COMPRESSED = [Middleware(GZipMiddleware)]
MAX_LOGGED_PATH = 200  #: longest path that the log shows


@dataclass(frozen=True, slots=True)
class WebServices:
    """Objects that the request handlers use."""

    feed: BrowserFeed
    instrument: InstrumentClient
    earlier_events: EarlierEvents
    broadcaster: EventBroadcaster
    limiter: ConnectionLimiter
    logins: Logins
    recorder: PageRecorder
    tls: RenewedContext | None = None  #: certificate of the server; None: plain HTTP


Handler = Callable[[WebServices, Request], Awaitable[Response]]


class EventStreamResponse(StreamingResponse):
    """Response that sends an event stream until the browser disconnects."""

    def __init__(self, broadcaster: EventBroadcaster, stream: EventStream) -> None:
        super().__init__(stream.read(), media_type="text/event-stream")
        self._broadcaster, self._stream = broadcaster, stream

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send the stream, and close the stream when the browser disconnects."""
        try:
            await super().__call__(scope, receive, send)
        finally:
            self._broadcaster.close_stream(self._stream)


def create_app(services: WebServices) -> ASGIApp:
    """Return the ASGI application with all routes.

    `RequestPacer` and `RequestGuard` handle each request first.
    """
    routes = [
        Route("/", _index, middleware=COMPRESSED),
        Mount("/static", StaticFiles(directory=STATIC, check_dir=False), middleware=COMPRESSED),
        Route("/api/about", _bound(services, _about), middleware=COMPRESSED),
        *(Route(path, _bound(services, handler)) for path, handler in _GET_HANDLERS.items()),
        *(Route(path, _bound(services, _sensor_page)) for path in SENSOR_PAGES),
        *WriteRoutes(services.instrument, services.logins, services.feed).routes(),
        *health_routes(services.feed),
        *LoginRoutes(services.logins, services.instrument).routes(),
        *RecordingRoutes(services.recorder, services.logins, services.feed).routes(),
    ]
    exception_handlers: dict[Any, Any] = {
        HttpRequestError: _on_request_error,
        HTTPException: _on_http_exception,
        Exception: _on_internal_error,
    }
    app: ASGIApp = Starlette(routes=routes, exception_handlers=exception_handlers)
    if services.tls is not None:
        app = PlainHttp(app, PLAIN_HTTP_PATHS)
    return RequestPacer(RequestGuard(app), services.logins.knows)


def _bound(services: WebServices, handler: Handler) -> Callable[[Request], Awaitable[Response]]:
    async def handle(request: Request) -> Response:
        return await handler(services, request)

    return handle


async def _index(_request: Request) -> Response:
    return FileResponse(STATIC / "index.html")


# ---- read


async def _about(services: WebServices, _request: Request) -> Response:
    return json_response(instrument_info(services.feed.header))


async def _live(services: WebServices, request: Request) -> Response:
    if request.method == "HEAD":
        return Response(media_type="text/event-stream")
    client, feed = _client_address(request), services.feed
    owner = StreamOwner(client_network(client[0]), services.logins.knows(request))
    if not services.broadcaster.make_room(owner):
        text = f"{MAX_STREAMS} browsers are already connected. Close one, or log in. VENT still works."
        return error_response(503, text)
    services.limiter.start_streaming(client)
    stream = services.broadcaster.open_stream(
        owner,
        [*feed.initial_messages(), services.recorder.message()],
        feed.history_messages(),
        lambda: services.limiter.disconnect(client),
        time.monotonic(),
    )
    return EventStreamResponse(services.broadcaster, stream)


async def _registers(services: WebServices, _request: Request) -> Response:
    if services.feed.snapshot is None:
        return error_response(503, services.feed.down_reason)
    return json_response({"blocks": register_blocks(services.feed.snapshot)})


async def _frames(services: WebServices, _request: Request) -> Response:
    if services.feed.snapshot is None:
        return error_response(503, services.feed.down_reason)
    return json_response({"frames": can_frames(services.feed.health)})


async def _metrics(services: WebServices, request: Request) -> Response:
    """Return the metrics for Prometheus. They need no login, as all values that the page shows."""
    metrics = metrics_text(reading_of(services.feed), request.headers.get("accept", ""))
    return Response(metrics.text, headers={"Content-Type": metrics.media_type, "Cache-Control": "no-store"})


async def _sensor_page(services: WebServices, request: Request) -> Response:
    """Return an XML page for clients of ATI sensors. The page exists only while RDT is enabled."""
    header = services.feed.header
    if not header:
        return error_response(503, services.feed.down_reason)
    if not header["configuration"]["rdt"]["enabled"]:
        raise HTTPException(404)
    simulated = bool(header["simulated"] or header.get("replay"))
    page = SENSOR_PAGES[request.url.path](header["serial_number"], simulated)
    return Response(page, media_type="text/xml")


async def _vent_state(services: WebServices, _request: Request) -> Response:
    return vent_state_page(services.feed.snapshot, services.feed.down_reason)


def _client_address(request: Request) -> ClientAddress:
    return (request.client.host, request.client.port) if request.client else ("", 0)


_GET_HANDLERS: Mapping[str, Handler] = {
    "/api/live": _live,
    "/api/registers": _registers,
    "/api/frames": _frames,
    VENT_STATE_PATH: _vent_state,
    "/metrics": _metrics,
}

# ---- errors


async def _on_request_error(_request: Request, error: HttpRequestError) -> Response:
    return error_response(error.status, str(error))


async def _on_http_exception(request: Request, error: HTTPException) -> Response:
    status = HTTPStatus(error.status_code)
    text = STATUS_TEXTS.get(status, error.detail)
    return error_answer(request.url.path, request.headers, status, text)


async def _on_internal_error(request: Request, _error: Exception) -> Response:
    path = printable(request.url.path)[:MAX_LOGGED_PATH]
    _log.warning(time.monotonic(), "web: internal error in %s", path, exc_info=True)
    text = "The web server had an internal error. See the log of the host process."
    return error_answer(request.url.path, request.headers, 500, text)
