"""Logins of users on the page: check of name and password, sessions, and what a user may do."""

from __future__ import annotations

import time
from collections.abc import Collection
from typing import NoReturn

from starlette.requests import HTTPConnection
from starlette.responses import Response

from pneuforce.instrument.users.file import NAME, User
from pneuforce.registers.rights import DEFAULT_ROLES, RIGHTS, writable_quantities
from pneuforce.web.login.known_browsers import LIFE_S, KnownBrowsers
from pneuforce.web.login.login_events import (
    NOT_LOGGED_IN,
    NOT_PERMITTED,
    TOO_MANY_ATTEMPTS,
    WRONG_PASSWORD,
    LoginEvents,
)
from pneuforce.web.login.login_limiter import LoginLimiter
from pneuforce.web.login.password_check import PasswordCheck, TooManyChecks
from pneuforce.web.login.sessions import UserSession, WebSessions
from pneuforce.web.login.user_directory import UserDirectory
from pneuforce.web.server.client_network import client_network, plain_address
from pneuforce.web.server.http_json import HttpRequestError, json_response

LOGGED_OUT = "requested"
REPLACED = "new_login"
#: Quantities that only a user with all rights may write. A recording needs these rights, too.
ALL_QUANTITIES = writable_quantities(RIGHTS)

NO_USERS = (
    "No user exists, so this page can only vent. Create a user on the computer of the instrument: "
    "pneuforce users add NAME --role operator --config FILE."
)
UNUSABLE = "The file of the users cannot be used. The log of the instrument states the reason."
WRONG = "The name or the password is wrong."
LIMITED = (
    "Too many wrong passwords were sent from your address. "
    "Send yours again every few seconds, until it is compared."
)
BUSY = "Too many logins at the same time. Try again."
LOG_IN = "You are not logged in, or your login has ended. Log in."


class Logins:
    """Users, sessions, known browsers and login events of one web server."""

    def __init__(self, directory: UserDirectory, sessions: WebSessions) -> None:
        self.directory = directory
        self.events = LoginEvents()
        self._sessions = sessions
        self._limiter = LoginLimiter()
        self._passwords = PasswordCheck()
        self._browsers = KnownBrowsers()

    def knows(self, request: HTTPConnection) -> bool:
        """Return True if the browser that sends a request has logged in before."""
        return self._browsers.contains(_cookie(request, "browser"), time.monotonic())

    def session_of(self, request: HTTPConnection) -> UserSession | None:
        """Return the session of a request; None if no user is logged in."""
        return self._sessions.find(_cookie(request, "session"), self.directory.users, time.monotonic())

    def peer_name(self, request: HTTPConnection) -> str:
        """Return the address of a request as in the event log: `name@address` if a user is logged in."""
        session = self.session_of(request)
        return _peer_name(session.user, address_of(request)) if session else address_of(request)

    def require_session(self, request: HTTPConnection) -> UserSession:
        """Return the session of a request, which shows that the user is active. Raises HttpRequestError."""
        session = self.session_of(request)
        if session is None:
            self.events.add_failure(address_of(request), NOT_LOGGED_IN)
            raise HttpRequestError(401, LOG_IN if self.directory.users else NO_USERS)
        session.active_s = time.monotonic()
        return session

    def authorize(self, request: HTTPConnection, quantities: Collection[str] = ALL_QUANTITIES) -> None:
        """Raise HttpRequestError if no user is logged in, or if the user may not write all quantities."""
        user = self.require_session(request).user
        if not writable_quantities(DEFAULT_ROLES[user.role]).issuperset(quantities):
            self.events.add_failure(_peer_name(user, address_of(request)), NOT_PERMITTED)
            raise HttpRequestError(403, f"{user.name} is a {user.role} and may only read and vent.")

    async def log_in(self, request: HTTPConnection, name: str, password: str) -> Response:
        """Begin a session. Return the response with its cookie. Raises HttpRequestError."""
        address, users = address_of(request), self.directory.users
        if not users:
            raise (
                HttpRequestError(503, UNUSABLE) if self.directory.problem else HttpRequestError(401, NO_USERS)
            )
        browser = _cookie(request, "browser")
        is_known = self.knows(request)
        client = f"browser {browser}" if is_known else client_network(address)
        if not self._limiter.take_turn(client, name, password, time.monotonic()):
            self._fail(429, LIMITED, TOO_MANY_ATTEMPTS, address)
        user = users.get(name)
        try:
            is_right = await self._passwords.matches(password, user.password if user else None, is_known)
        except TooManyChecks:
            self._limiter.take_back(client)
            raise HttpRequestError(503, BUSY) from None
        if user is None or not is_right:
            self._fail(401, WRONG, WRONG_PASSWORD, address, name if NAME.fullmatch(name) else "")
        self._limiter.take_back(client)
        return self._begin(request, user)

    def _fail(self, status: int, text: str, reason: str, address: str, name: str = "") -> NoReturn:
        self.events.add_failure(address, reason, name)
        raise HttpRequestError(status, text)

    def _begin(self, request: HTTPConnection, user: User) -> Response:
        now_s = time.monotonic()
        self._end(request, REPLACED)
        response = json_response(facts_of(user))
        key = self._sessions.begin(user, address_of(request), now_s)
        _set_cookie(request, response, "session", key)
        browser = self._browsers.remember(_cookie(request, "browser"), now_s)
        _set_cookie(request, response, "browser", browser, round(LIFE_S))
        self.events.add_login(_peer_name(user, address_of(request)))
        return response

    def log_out(self, request: HTTPConnection) -> Response:
        """End the session of a request. Return the response, which removes its cookie."""
        self._end(request, LOGGED_OUT)
        response = json_response({})
        response.delete_cookie(_cookie_name(request, "session"))
        return response

    def _end(self, request: HTTPConnection, reason: str) -> None:
        if session := self._sessions.end(_cookie(request, "session")):
            self.events.add_logout(_peer_name(session.user, address_of(request)), reason)

    def remove_old_sessions(self) -> None:
        """End the sessions that are over, for the event log."""
        for session, reason in self._sessions.remove_old(self.directory.users, time.monotonic()):
            self.events.add_logout(_peer_name(session.user, session.address), reason)


def facts_of(user: User | None) -> dict[str, str | bool] | None:
    """Return name, role and rights of a user as JSON values, None for no user."""
    if user is None:
        return None
    return {"name": user.name, "role": user.role, "may_write": bool(DEFAULT_ROLES[user.role])}


def address_of(request: HTTPConnection) -> str:
    """Return the address of the client, as the event log shows the address."""
    return plain_address(request.client.host) if request.client else ""


def _peer_name(user: User, address: str) -> str:
    return f"{user.name}@{address}"


def _cookie(request: HTTPConnection, purpose: str) -> str:
    return request.cookies.get(_cookie_name(request, purpose), "")


def _cookie_name(request: HTTPConnection, purpose: str) -> str:
    """Return the name of a cookie. It contains the port, because browsers send cookies to all ports."""
    port = request.headers.get("host", "").rpartition(":")[2]
    return f"pneuforce-{purpose}-{port if port.isdecimal() else 80}"


def _set_cookie(
    request: HTTPConnection, response: Response, purpose: str, key: str, life_s: int | None = None
) -> None:
    """Set a cookie that scripts and other sites cannot use. Without a life, it ends with the browser."""
    is_https = request.url.scheme == "https"
    response.set_cookie(
        _cookie_name(request, purpose), key, life_s, httponly=True, samesite="strict", secure=is_https
    )
