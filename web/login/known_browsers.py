"""Known browsers: browsers in which a user has logged in since the start of the web process.

A known browser has a random key in a cookie, also after the logout. The cookie permits nothing. It only
distinguishes the browser from other clients at the same address. Their wrong passwords and floods of requests
therefore do not delay the user.
"""

from __future__ import annotations

import secrets
from collections import OrderedDict

MAX_BROWSERS = 64  #: if there are more, the browser that logged in least recently is forgotten
LIFE_S = 7 * 86_400.0  #: a browser is forgotten if it has not logged in again for this time
KEY_BYTES = 24


class KnownBrowsers:
    """Keys of the known browsers. They are kept in memory only."""

    def __init__(self) -> None:
        self._until_s: OrderedDict[str, float] = OrderedDict()

    def contains(self, key: str, now_s: float) -> bool:
        """Return True if a browser with this key has logged in."""
        return now_s <= self._until_s.get(key, float("-inf"))

    def remember(self, key: str, now_s: float) -> str:
        """Remember a browser in which a user has logged in. Return its key, or a new key if unknown."""
        if not self.contains(key, now_s):
            key = secrets.token_urlsafe(KEY_BYTES)
        self._until_s[key] = now_s + LIFE_S
        self._until_s.move_to_end(key)
        if len(self._until_s) > MAX_BROWSERS:
            self._until_s.popitem(last=False)
        return key
