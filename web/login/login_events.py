"""Logins, logouts and failed logins, which the web process reports to the instrument for the event log."""

from __future__ import annotations

from collections import Counter, deque
from typing import NamedTuple

REPORT_PERIOD_S = 1.0  #: period at which failed logins and ended sessions are reported
MAX_FAILURES = 64  #: different failures in one period; further ones are reported together
MAX_CHANGES = 256
OTHERS = "others"

ACCEPTED = "accepted"
WRONG_PASSWORD = "wrong_password"
TOO_MANY_ATTEMPTS = "too_many_attempts"  #: the password was not compared, because of the rate limit
NOT_LOGGED_IN = "not_logged_in"  #: a request that needs a login
NOT_PERMITTED = "not_permitted"  #: a request that the role of the user does not permit


class LoginEvent(NamedTuple):
    """Event of a user or of a client that wants to be one."""

    kind: str  #: login or logout
    address: str  #: address of the browser, after `name@` if a user is logged in
    result: str
    user: str = ""  #: name that a client has sent with a wrong password


class LoginEvents:
    """Events since the last report. Equal failures are counted."""

    def __init__(self) -> None:
        self._failures: Counter[LoginEvent] = Counter()
        self._changes: deque[LoginEvent] = deque(maxlen=MAX_CHANGES)

    def add_failure(self, address: str, reason: str, user: str = "") -> None:
        """Count a failed login, or a request that was rejected because of its missing login."""
        failure = LoginEvent("login", address, reason, user)
        if failure not in self._failures and len(self._failures) >= MAX_FAILURES:
            failure = LoginEvent("login", OTHERS, reason)
        self._failures[failure] += 1

    def add_login(self, address: str) -> None:
        """Add a login. `address` contains the name of the user."""
        self._changes.append(LoginEvent("login", address, ACCEPTED))

    def add_logout(self, address: str, reason: str) -> None:
        """Add the end of a login. `address` contains the name of the user."""
        self._changes.append(LoginEvent("logout", address, reason))

    def take(self) -> list[dict[str, str | int]]:
        """Return the events as JSON values, and forget them."""
        events = [(event, 1) for event in self._changes] + list(self._failures.items())
        self._changes.clear()
        self._failures.clear()
        return [{**event._asdict(), "times": times} for event, times in events]
