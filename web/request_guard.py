"""What a request must say of itself before anybody looks at what it asks; and what each answer forbids.

A page of somebody else's, in a browser on this machine, can send requests here. Its name stands in `Origin`,
and where it has made its own name point to this machine, that name stands in `Host`.
"""

from __future__ import annotations

import socket
from collections.abc import Mapping
from ipaddress import ip_address

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from page.answers import told

SECURITY: Mapping[str, str] = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; "
    "connect-src 'self'; font-src 'self'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "same-origin",  # a form of ours must name its origin, too
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}
_SAFE = frozenset(("GET", "HEAD"))


def own_names() -> frozenset[str]:
    """What this machine is called, on a network with mDNS too."""
    name = socket.gethostname().lower()
    short = name.partition(".")[0]
    return frozenset(("localhost", name, short, f"{short}.local"))


def is_own(host: str, names: frozenset[str]) -> bool:
    """Whether a Host header names this machine: by an address, or one of `names`."""
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


def is_same_origin(headers: Mapping[str, str]) -> bool:
    """Whether our own page sends this, or a program that is no browser: those name no origin."""
    origin = headers.get("origin")
    if origin is None:
        return headers.get("sec-fetch-site", "same-origin") in ("same-origin", "none")
    scheme, _, whose = origin.lower().partition("://")
    return scheme in ("http", "https") and whose == headers.get("host", "").lower()


class Guard:
    """Lets only requests through that are meant for this page, and puts the restrictions into each answer."""

    def __init__(self, app: ASGIApp, names: frozenset[str] | None = None) -> None:
        self._app = app
        self._names = own_names() if names is None else names

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer 403 or pass the request on."""

        async def restricted(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                headers.update(SECURITY)
                headers.setdefault(
                    "Cache-Control", "no-store" if scope["path"].startswith("/api/") else "no-cache"
                )
            await send(message)

        why = self._objection(scope, Headers(scope=scope))
        await (self._app if why is None else told(403, why))(scope, receive, restricted)

    def _objection(self, scope: Scope, headers: Headers) -> str | None:
        if not is_own(headers.get("host", ""), self._names):
            return "The Host header does not name this machine: use its address or its name."
        is_link = scope["method"] in _SAFE and not scope["path"].startswith("/api/")
        if not is_link and not is_same_origin(headers):
            return "This request comes from another site's page."
        return None
