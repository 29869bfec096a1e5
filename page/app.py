"""The routes: what a browser may ask for."""

from __future__ import annotations

import logging
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from http import HTTPStatus
from pathlib import Path
from typing import Any

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, Response, StreamingResponse
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp, Receive, Scope, Send

from page.about import about
from page.answers import VENT, Refused, answer, asked, seen, told, wanted
from page.client import Instrument, NoAnswer
from page.crowd import Crowd
from page.guard import Guard
from page.inspector import frames, register_blocks
from page.streams import Stream, Streams
from page.tokens import TRY_AGAIN_S, Tokens, Verdict
from page.view import View
from registers.advice import REFUSAL_WORDS
from registers.sparing_log import SparingLog

STATIC = Path(__file__).parent / "static"
STOP_SWITCH = "It is not known whether the balloon is vented: use the stop switch."
NOT_CARRIED_OUT = "Look at what is shown before you try again."
WORDS = {
    HTTPStatus.NOT_FOUND: "There is nothing here by that name.",
    HTTPStatus.METHOD_NOT_ALLOWED: "That cannot be done with this address.",
}

Handler = Callable[[Request], Awaitable[Response]]


@dataclass(frozen=True, slots=True)
class Parts:
    """What the routes stand between."""

    view: View
    instrument: Instrument
    streams: Streams
    crowd: Crowd
    tokens: Tokens


class Live(StreamingResponse):
    """The answer that goes on: a stream, which leaves when its browser does."""

    def __init__(self, streams: Streams, stream: Stream) -> None:
        super().__init__(stream.read(), media_type="text/event-stream")
        self._streams, self._stream = streams, stream

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send until the stream or the browser ends."""
        try:
            await super().__call__(scope, receive, send)
        finally:
            self._streams.leave(self._stream)


def application(parts: Parts) -> ASGIApp:
    """The whole page, guarded."""
    routes = [
        Route("/", _index),
        Mount("/static", StaticFiles(directory=STATIC, check_dir=False)),
        *(Route(path, _of(parts, handler)) for path, handler in _LOOKS.items()),
        *(Route(path, _of(parts, handler), methods=["POST"]) for path, handler in _ORDERS.items()),
    ]
    handlers: dict[Any, Any] = {Refused: _refused, HTTPException: _no_such_thing, Exception: _error_of_ours}
    return Guard(Starlette(routes=routes, exception_handlers=handlers))


def _of(parts: Parts, handler: Callable[[Parts, Request], Awaitable[Response]]) -> Handler:
    async def handle(request: Request) -> Response:
        return await handler(parts, request)

    return handle


async def _index(_request: Request) -> Response:
    return FileResponse(STATIC / "index.html")


# ---- looking


async def _about(parts: Parts, _request: Request) -> Response:
    return answer(about(parts.view.begun, parts.tokens.writable))


async def _live(parts: Parts, request: Request) -> Response:
    if request.method == "HEAD":
        return Response(media_type="text/event-stream")
    if parts.streams.full:
        return told(
            503, "So many browsers look already that no more can: close one. A vent works all the same."
        )
    client, view = _far_end(request), parts.view
    parts.crowd.keep(client)
    stream = parts.streams.join(
        view.greeting(), view.history(), lambda: parts.crowd.drop(client), time.monotonic()
    )
    return Live(parts.streams, stream)


async def _registers(parts: Parts, _request: Request) -> Response:
    if parts.view.snapshot is None:
        return told(503, parts.view.why)
    return answer({"blocks": register_blocks(parts.view.snapshot)})


async def _frames(parts: Parts, _request: Request) -> Response:
    if parts.view.snapshot is None:
        return told(503, parts.view.why)
    return answer({"frames": frames(parts.view.health)})


# ---- ordering


async def _vent(parts: Parts, _request: Request) -> Response:
    try:
        result = await parts.instrument.ask(VENT)
    except NoAnswer as error:
        return told(503, f"{error} {STOP_SWITCH}")
    return _became(result)


async def _write(parts: Parts, request: Request) -> Response:
    facts = await asked(request)
    _check(parts, facts, request)
    values, seen_s = wanted(facts), seen(facts)
    try:
        result = await parts.instrument.ask(values, seen_s)
    except NoAnswer as error:
        return told(503, f"{error} {NOT_CARRIED_OUT}")
    return _became(result)


async def _token(parts: Parts, request: Request) -> Response:
    _check(parts, await asked(request), request)
    return answer({})


def _became(result: Any) -> Response:
    refusal, why = str(result.get("refusal")), result.get("why")
    if why:
        return answer({"refusal": refusal, "text": why}, 400)
    return answer({"refusal": refusal, "text": REFUSAL_WORDS.get(refusal, refusal)})


def _check(parts: Parts, facts: dict[str, Any], request: Request) -> None:
    """Raises Refused: no token, or not the right one."""
    if not parts.tokens.writable:
        raise Refused(401, "No token is configured ([page] token): nobody may write here.")
    verdict = parts.tokens.judge(facts.get("token"), _far_end(request)[0], time.monotonic())
    if verdict is Verdict.WRONG:
        raise Refused(401, "That is not the operator's token.")
    if verdict is Verdict.WAIT:
        raise Refused(429, f"Too many wrong tokens from your address: wait {TRY_AGAIN_S:.0f} s.")


def _far_end(request: Request) -> tuple[str, int]:
    return (request.client.host, request.client.port) if request.client else ("", 0)


_LOOKS = {"/api/about": _about, "/api/live": _live, "/api/registers": _registers, "/api/frames": _frames}
_ORDERS = {"/api/vent": _vent, "/api/write": _write, "/api/token": _token}

# ---- what went wrong

_say = SparingLog(logging.getLogger("pneuforce"), 60.0).say


async def _refused(_request: Request, error: Refused) -> Response:
    return told(error.status, str(error))


async def _no_such_thing(_request: Request, error: HTTPException) -> Response:
    return told(error.status_code, WORDS.get(HTTPStatus(error.status_code), error.detail))


async def _error_of_ours(request: Request, _error: Exception) -> Response:
    _say(time.monotonic(), "page: %s failed after an error of ours", request.url.path, trace=True)
    return told(500, "The page failed at this; its log says more.")
