"""Rate limits: a logger that drops lines of a flood, and a token bucket."""

from __future__ import annotations

import logging
from dataclasses import dataclass

from pneuforce.support.counted import counted

MAX_LINES = 5


class RateLimitedLogger:
    """Logger that writes at most five lines per period, and later the number and the last of the others."""

    def __init__(self, logger: logging.Logger, period_s: float = 1.0) -> None:
        self._logger = logger
        self._period_s = period_s
        self._period_begin_s = float("-inf")
        self._lines = 0
        self._last_dropped = ""

    def warning(self, now_s: float, message: str, *args: object, exc_info: bool = False) -> None:
        """Log one line at level WARNING. With `exc_info`, add the exception that is being handled."""
        if now_s - self._period_begin_s >= self._period_s:
            if self._lines > MAX_LINES:
                dropped = counted(self._lines - MAX_LINES, "more line")
                self._logger.warning("not logged: %s, the last: %s", dropped, self._last_dropped)
            self._period_begin_s, self._lines = now_s, 0
        self._lines += 1
        if self._lines <= MAX_LINES:
            self._logger.warning(message, *args, exc_info=exc_info)
        else:
            self._last_dropped = message % args if args else message


@dataclass(slots=True)
class TokenBucket:
    """Token bucket that allows `burst` events at once, and then `per_s` events per second."""

    per_s: float
    burst: float
    _tokens: float = -1.0
    _at_s: float = 0.0

    def __post_init__(self) -> None:
        self._tokens = self.burst

    def take(self, now_s: float) -> bool:
        """Take one token; return False if none is left."""
        self._refill(now_s)
        if self._tokens < 1.0:
            return False
        self._tokens -= 1.0
        return True

    def is_full(self, now_s: float) -> bool:
        """Return True if the bucket is as full as a new bucket."""
        self._refill(now_s)
        return self._tokens >= self.burst

    def _refill(self, now_s: float) -> None:
        self._tokens = min(self.burst, self._tokens + self.per_s * max(0.0, now_s - self._at_s))
        self._at_s = now_s
