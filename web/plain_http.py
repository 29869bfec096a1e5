"""Requests without TLS to a server with a certificate."""

from __future__ import annotations

from collections.abc import Collection

from starlette.datastructures import Headers
from starlette.responses import RedirectResponse
from starlette.types import ASGIApp, Receive, Scope, Send

from pneuforce.web.plain_page import error_answer

_READING_METHODS = frozenset(("GET", "HEAD"))
USE_HTTPS = "This address accepts the request over HTTPS only: use {url}"


class PlainHttp:
    """ASGI middleware that redirects requests without TLS to HTTPS, except requests for some paths.

    Requests that are no reads are rejected, because their content has already been sent without encryption.
    """

    def __init__(self, app: ASGIApp, served_paths: Collection[str] = ()) -> None:
        self._app = app
        self._served_paths = frozenset(served_paths)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request to the application, or answer with a redirection or with status 403."""
        app = self._app
        if scope["scheme"] != "https" and scope["path"] not in self._served_paths:
            headers = Headers(scope=scope)
            url = https_url(headers.get("host", ""), scope["raw_path"], scope["query_string"])
            if scope["method"] in _READING_METHODS:
                app = RedirectResponse(url)
            else:
                app = error_answer(scope["path"], headers, 403, USE_HTTPS.format(url=url))
        await app(scope, receive, send)


def https_url(host: str, raw_path: bytes, query: bytes) -> str:
    """Return the address of a request with the scheme https. A path that is an address becomes "/"."""
    path = raw_path.decode("ascii") if raw_path.startswith(b"/") else "/"
    return f"https://{host}{path}" + (f"?{query.decode('ascii')}" if query else "")
