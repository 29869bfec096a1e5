"""Protection against requests from other web sites, and the security headers of each response.

A web page of another site can make a browser on this machine send requests to the instrument. The browser
puts the name of the other site into the header `Origin`. If the other site has pointed its own name to this
machine (DNS rebinding), that name is in the header `Host`.

The check of `Host` allows every IP address, because DNS rebinding needs a name. Starlette's
TrustedHostMiddleware compares `Host` with a fixed list, and the list cannot contain every IP address.
"""

from __future__ import annotations

import socket
from collections.abc import Mapping
from ipaddress import ip_address

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from pneuforce.web.plain_page import error_answer

SECURITY_HEADERS: Mapping[str, str] = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; "
    "connect-src 'self'; font-src 'self'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    # "no-referrer" would make the browser send "Origin: null" with the form of the VENT button
    "Referrer-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}
#: Browsers use only HTTPS for a host name for this time (RFC 6797). They ignore the header for an address.
HSTS = "max-age=2592000"
_SAFE_METHODS = frozenset(("GET", "HEAD"))


def machine_names() -> frozenset[str]:
    """Return the host names of this machine, including the mDNS name (.local)."""
    name = socket.gethostname().lower()
    short = name.partition(".")[0]
    return frozenset(("localhost", name, short, f"{short}.local"))


def is_this_machine(host: str, names: frozenset[str]) -> bool:
    """Return True if a Host header contains an IP address or one of `names`, with or without a port."""
    name, bracket, port = host.strip().rpartition("]")
    if not bracket:
        name, _, port = host.strip().partition(":")
    elif not name.startswith("["):
        return False
    if port and not port.lstrip(":").isdecimal():
        return False
    try:
        ip_address(name.removeprefix("["))
    except ValueError:
        return not bracket and name.lower() in names
    return True


def is_same_origin(headers: Mapping[str, str], scheme: str) -> bool:
    """Return True if a request comes from the instrument's web page or from a program that is not a browser.

    `scheme` is that of the connection. A request over HTTPS must not come from a page that was sent without
    encryption. Programs that are not browsers send no origin.
    """
    origin = headers.get("origin")
    if origin is None:
        return headers.get("sec-fetch-site", "same-origin") in ("same-origin", "none")
    origin_scheme, _, authority = origin.lower().partition("://")
    return origin_scheme in (scheme, "https") and authority == headers.get("host", "").lower()


class RequestGuard:
    """ASGI middleware that rejects requests from other sites and adds the security headers."""

    def __init__(self, app: ASGIApp, names: frozenset[str] | None = None) -> None:
        self._app = app
        self._names = machine_names() if names is None else names

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Respond with status 403, or pass the request to the application."""

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                headers.update(SECURITY_HEADERS)
                if scope["scheme"] == "https":
                    headers["Strict-Transport-Security"] = HSTS
                headers.setdefault(
                    "Cache-Control", "no-store" if scope["path"].startswith("/api/") else "no-cache"
                )
            await send(message)

        received = Headers(scope=scope)
        reason = self._reject_reason(scope, received)
        app = self._app if reason is None else error_answer(scope["path"], received, 403, reason)
        await app(scope, receive, send_with_headers)

    def _reject_reason(self, scope: Scope, headers: Headers) -> str | None:
        if not is_this_machine(headers.get("host", ""), self._names):
            return "The Host header does not name this machine. Use its IP address or its host name."
        # a link on another site may open the web page, but another site may not read or change anything
        is_link = scope["method"] in _SAFE_METHODS and not scope["path"].startswith("/api/")
        if not is_link and not is_same_origin(headers, scope["scheme"]):
            return "The request comes from the web page of another site. Open the instrument's own address."
        return None
