"""HTTP routes of the login: log in, log out, and the user who is logged in."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from pneuforce.instrument.users.password import MAX_CHARACTERS
from pneuforce.web.instrument_client import InstrumentClient
from pneuforce.web.login.login import Logins, facts_of
from pneuforce.web.server.http_json import HttpRequestError, json_response, read_json_object

MAX_NAME_CHARACTERS = 64


class LoginRoutes:
    """Request handlers for the login."""

    def __init__(self, logins: Logins, instrument: InstrumentClient) -> None:
        self._logins, self._instrument = logins, instrument

    def routes(self) -> list[Route]:
        """Return the routes of the request handlers."""
        handlers = {"/api/login": self.log_in, "/api/logout": self.log_out, "/api/session": self.session}
        return [Route(path, handler, methods=["POST"]) for path, handler in handlers.items()]

    async def log_in(self, request: Request) -> Response:
        """Log a user in. The record in the event log precedes the first write of the user."""
        body = await read_json_object(request)
        name = _text(body, "name", MAX_NAME_CHARACTERS).strip().lower()
        response = await self._logins.log_in(request, name, _text(body, "password", MAX_CHARACTERS))
        self._instrument.report(self._logins.events)
        return response

    async def log_out(self, request: Request) -> Response:
        """Log the user out."""
        response = self._logins.log_out(request)
        self._instrument.report(self._logins.events)
        return response

    async def session(self, request: Request) -> Response:
        """Return who is logged in. `active` in the request states that there was input on the page."""
        body = await read_json_object(request)
        session = self._logins.session_of(request)
        if session and body.get("active") is True:
            session.active_s = time.monotonic()
        users = bool(self._logins.directory.users)
        return json_response({"user": facts_of(session.user if session else None), "has_users": users})


def _text(body: Mapping[str, Any], key: str, max_characters: int) -> str:
    """Return a text of a request. Raises HttpRequestError."""
    value = body.get(key)
    if not isinstance(value, str) or len(value) > max_characters:
        raise HttpRequestError(400, f'"{key}" is missing, not a text, or too long.')
    return value
