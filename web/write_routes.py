"""HTTP routes that change the instrument: the vent, which needs no login, and all other writes."""

from __future__ import annotations

import logging
import time
from collections.abc import Mapping
from typing import Any

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from pneuforce.registers.write_request import parse_write_request
from pneuforce.support.rejected_write import describe_write
from pneuforce.support.throttle import RateLimitedLogger
from pneuforce.web.browser_feed import STATE_DIGITS, BrowserFeed
from pneuforce.web.instrument_client import InstrumentClient, InstrumentUnavailable
from pneuforce.web.login.login import Logins
from pneuforce.web.operator_texts import REJECT_TEXTS
from pneuforce.web.plain_page import NOT_VENTED, error_answer, plain_page, vent_accepted_page, wants_page
from pneuforce.web.server.http_json import (
    VENT,
    VENT_PATH,
    HttpRequestError,
    error_response,
    json_response,
    parse_seen_s,
    parse_values,
    read_json_object,
)

VENT_UNCONFIRMED = "Press the stop switch at the rig, or vent again."
WRITE_UNCONFIRMED = "The request was possibly executed: check the state."

_log = RateLimitedLogger(logging.getLogger("pneuforce"), 60.0)


class WriteRoutes:
    """Request handlers for the vent and for write requests."""

    def __init__(self, instrument: InstrumentClient, logins: Logins, feed: BrowserFeed) -> None:
        self._instrument, self._logins, self._feed = instrument, logins, feed

    def routes(self) -> list[Route]:
        """Return the routes of the request handlers."""
        handlers = {VENT_PATH: self.vent, "/api/write": self.write}
        return [Route(path, handler, methods=["POST"]) for path, handler in handlers.items()]

    async def vent(self, request: Request) -> Response:
        """Vent. The handler ignores the body and needs no login, so that nothing can prevent a vent."""
        try:
            answer = await self._instrument.vent(self._logins.peer_name(request))
        except InstrumentUnavailable as error:
            return error_answer(VENT_PATH, request.headers, 503, f"{error} {VENT_UNCONFIRMED}")
        if not wants_page(request.headers):
            return _answer_response(answer)
        reject_reason = str(answer.get("reject_reason"))
        if reject_reason == "none":
            return vent_accepted_page(bool(self._feed.header.get("replay")), self._feed.snapshot)
        return plain_page(NOT_VENTED, f"{REJECT_TEXTS.get(reject_reason, reject_reason)} {VENT_UNCONFIRMED}")

    async def write(self, request: Request) -> Response:
        """Write quantities. All values except a vent need the login of a user who may write them."""
        body = await read_json_object(request)
        if body.get("values") != VENT:
            self._logins.require_session(request)
        peer = self._logins.peer_name(request)
        try:
            values, seen_s = parse_values(body), parse_seen_s(body)
        except HttpRequestError as error:
            line = describe_write(("web", peer), "an invalid request", str(error))
            _log.warning(time.monotonic(), "%s", line)
            raise
        try:
            if values != VENT:
                await self._authorize(request, values)
            answer = await self._instrument.write(values, peer, seen_s)
        except InstrumentUnavailable as error:
            return error_response(503, f"{error} {WRITE_UNCONFIRMED}")
        return _answer_response(answer)

    async def _authorize(self, request: Request, values: Mapping[str, Any]) -> None:
        """Raise HttpRequestError if the user may not write these values. Execute a vent among them."""
        quantities = parse_write_request(values)
        try:
            self._logins.authorize(request, quantities)
        except HttpRequestError:
            if quantities.get("mode") == "vent":
                await self._instrument.vent(self._logins.peer_name(request))
            raise


def _answer_response(answer: Mapping[str, Any]) -> Response:
    """Return the HTTP response for an answer of the instrument: the reject reason, its text, and its time.

    The status is 400 if the request was invalid, otherwise 200.
    """
    reject_reason, invalid = str(answer.get("reject_reason")), answer.get("why")
    if invalid:
        return json_response({"reject_reason": reject_reason, "text": invalid}, 400)
    text, t_s = REJECT_TEXTS.get(reject_reason, reject_reason), round(answer["t_s"], STATE_DIGITS)
    return json_response({"reject_reason": reject_reason, "text": text, "t_s": t_s})
