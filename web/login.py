"""Check of the operator's token in a request, and the browsers that have presented the right token."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

from starlette.requests import HTTPConnection
from starlette.responses import Response

from pneuforce.web.client_network import client_network, plain_address
from pneuforce.web.failed_logins import TOO_MANY_ATTEMPTS, WRONG_TOKEN, FailedLogins
from pneuforce.web.http_json import HttpRequestError
from pneuforce.web.known_browsers import LIFE_S, KnownBrowsers, cookie_name
from pneuforce.web.operator_token import TokenResult, TokenVerifier

#: HTTP status, reason in the event log, and text for the operator.
LOGIN_ERRORS: Mapping[TokenResult, tuple[int, str, str]] = {
    TokenResult.INVALID: (401, WRONG_TOKEN, "The operator's token is wrong."),
    TokenResult.RATE_LIMITED: (
        429,
        TOO_MANY_ATTEMPTS,
        "Too many wrong tokens were sent from your address. "
        "Send your token again every few seconds, until it is compared.",
    ),
}


class Logins:
    """Operator's token, known browsers and failed logins of one web server."""

    def __init__(self, token: str) -> None:
        self.failed = FailedLogins()
        self._tokens = TokenVerifier(token)
        self._browsers = KnownBrowsers()

    @property
    def is_configured(self) -> bool:
        """Return True if a token is configured, so that operators can write."""
        return self._tokens.is_configured

    def knows(self, request: HTTPConnection) -> bool:
        """Return True if the browser that sends a request has logged in before."""
        return self._browsers.contains(_browser_key(request), time.monotonic())

    def check(self, body: Mapping[str, Any], request: HTTPConnection) -> None:
        """Raise HttpRequestError if no token is configured or the token of the request is not accepted."""
        if not self.is_configured:
            raise HttpRequestError(
                401,
                "Writing is disabled because no token is configured. Set [web] token in the configuration.",
            )
        address = address_of(request)
        client = f"browser {_browser_key(request)}" if self.knows(request) else client_network(address)
        result = self._tokens.verify(body.get("token"), client, time.monotonic())
        if result is not TokenResult.VALID:
            status, reason, text = LOGIN_ERRORS[result]
            self.failed.add(address, reason)
            raise HttpRequestError(status, text)

    def remember_browser(self, request: HTTPConnection, response: Response) -> Response:
        """Return the response with a cookie for a browser that has presented the right token."""
        key = self._browsers.remember(_browser_key(request), time.monotonic())
        response.set_cookie(
            _cookie_name(request),
            key,
            round(LIFE_S),
            secure=request.url.scheme == "https",
            httponly=True,
            samesite="strict",
        )
        return response


def address_of(request: HTTPConnection) -> str:
    """Return the address of the client, as the event log shows the address."""
    return plain_address(request.client.host) if request.client else ""


def _browser_key(request: HTTPConnection) -> str:
    return request.cookies.get(_cookie_name(request), "")


def _cookie_name(request: HTTPConnection) -> str:
    return cookie_name(request.headers.get("host", ""))
