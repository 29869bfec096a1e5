"""Delay of requests during a flood of requests, so that the event loop has time for a vent."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Callable

from starlette.requests import HTTPConnection
from starlette.types import ASGIApp, Receive, Scope, Send

from pneuforce.web.server.http_json import VENT_PATH, error_response

REQUESTS_PER_S = 100.0  #: mean rate of requests that are processed during a flood
BURST = 300  #: requests that are processed without a delay; a browser needs 30 to open the page
#: A request with a longer delay is rejected. If 32 browsers open the page at once, the delay is shorter.
MAX_DELAY_S = 8.0
REJECTION_DELAY_S = 1.0
OVERLOADED = "The web server receives too many requests. Try again later. VENT still works."


class PacingSchedule:
    """Schedule that allows `BURST` requests at once, and then `REQUESTS_PER_S`."""

    def __init__(self) -> None:
        self._next_s = -math.inf  # time at which the next request may start if the burst is used up

    def delay_s(self, now_s: float) -> float | None:
        """Return the delay of a request that arrives now [s], or None if the request is rejected."""
        next_s = max(self._next_s, now_s - BURST / REQUESTS_PER_S) + 1.0 / REQUESTS_PER_S
        if next_s - now_s > MAX_DELAY_S:
            return None
        self._next_s = next_s
        return max(0.0, next_s - now_s)


class RequestPacer:
    """ASGI middleware that delays requests during a flood. A vent is never delayed.

    A browser that has logged in is not delayed either. Other clients at its address may send the flood.
    """

    def __init__(self, app: ASGIApp, is_known: Callable[[HTTPConnection], bool]) -> None:
        self._app = app
        self._is_known = is_known
        self._schedule = PacingSchedule()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request to the application, after a delay if necessary, or respond with status 503."""
        app = self._app
        if scope["path"] != VENT_PATH and not self._is_known(HTTPConnection(scope)):
            delay_s = self._schedule.delay_s(time.monotonic())
            if delay_s is None:
                delay_s, app = REJECTION_DELAY_S, error_response(503, OVERLOADED)
            if delay_s:
                await asyncio.sleep(delay_s)
        await app(scope, receive, send)
