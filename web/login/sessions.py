"""Sessions: logins of users on the page. A session has a random key, which the browser keeps in a cookie."""

from __future__ import annotations

import secrets
from collections.abc import Mapping
from dataclasses import dataclass

from pneuforce.instrument.users.file import User

KEY_BYTES = 32
MAX_SESSIONS_PER_USER = 8  #: a further login ends the oldest session of the user

USED_UP = "too_many_sessions"
IDLE = "idle"
EXPIRED = "expired"
CHANGED = "user_changed"


@dataclass(slots=True)
class UserSession:
    """Login of one user in one browser."""

    user: User
    address: str  #: address of the browser at its login
    started_s: float
    active_s: float  #: time of the last input on the page


class WebSessions:
    """Sessions of all users. They are kept in memory only. Time is an argument."""

    def __init__(self, idle_timeout_s: float, timeout_s: float) -> None:
        self._idle_timeout_s, self._timeout_s = idle_timeout_s, timeout_s
        self._sessions: dict[str, UserSession] = {}  # by key, oldest first

    def begin(self, user: User, address: str, now_s: float) -> str:
        """Begin a session. Return its key."""
        key = secrets.token_urlsafe(KEY_BYTES)
        self._sessions[key] = UserSession(user, address, now_s, now_s)
        return key

    def find(self, key: str, users: Mapping[str, User], now_s: float) -> UserSession | None:
        """Return the session of a key; None if there is none or it is over."""
        session = self._sessions.get(key)
        return session if session and not self._why_over(session, users, now_s) else None

    def end(self, key: str) -> UserSession | None:
        """End a session, and return it. Return None if there is none."""
        return self._sessions.pop(key, None)

    def remove_old(self, users: Mapping[str, User], now_s: float) -> list[tuple[UserSession, str]]:
        """Remove the sessions that are over. Return them with the reasons."""
        over = {
            key: why
            for key, session in self._sessions.items()
            if (why := self._why_over(session, users, now_s))
        }
        for name in {session.user.name for session in self._sessions.values()}:
            keys = [key for key, each in self._sessions.items() if each.user.name == name and key not in over]
            over |= dict.fromkeys(keys[:-MAX_SESSIONS_PER_USER], USED_UP)
        return [(self._sessions.pop(key), why) for key, why in over.items()]

    def _why_over(self, session: UserSession, users: Mapping[str, User], now_s: float) -> str:
        """Return why a session is over, "" if it is not. A new password or role also ends a session."""
        if users.get(session.user.name) != session.user:
            return CHANGED
        if now_s - session.started_s > self._timeout_s:
            return EXPIRED
        return IDLE if now_s - session.active_s > self._idle_timeout_s else ""
