"""Count of failed logins, which the web process reports to the instrument once per second."""

from __future__ import annotations

from collections import Counter
from typing import NamedTuple

REPORT_PERIOD_S = 1.0
MAX_ADDRESSES = 32  #: failed logins of further addresses in the same period are reported together
OTHERS = "others"
WRONG_TOKEN = "wrong_token"
TOO_MANY_ATTEMPTS = "too_many_attempts"  #: the token was not compared, because of the rate limit


class FailedLogin(NamedTuple):
    """Kind of failed login that is counted."""

    address: str
    reason: str


class FailedLogins:
    """Failed logins since the last report."""

    def __init__(self) -> None:
        self._counts: Counter[FailedLogin] = Counter()

    def add(self, address: str, reason: str) -> None:
        """Count a failed login from an address."""
        known = {login.address for login in self._counts}
        is_counted = address in known or len(known) < MAX_ADDRESSES
        self._counts[FailedLogin(address if is_counted else OTHERS, reason)] += 1

    def take(self) -> list[dict[str, str | int]]:
        """Return the counts as JSON values, and start to count again."""
        counts, self._counts = self._counts, Counter()
        return [{**login._asdict(), "times": times} for login, times in counts.items()]
