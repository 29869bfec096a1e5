"""Warning about a condition that lasts, logged at growing intervals."""

from __future__ import annotations

import logging

FIRST_INTERVAL_S, MAX_INTERVAL_S = 10.0, 3600.0


class RepeatedWarning:
    """Logger for a condition that lasts, for example a rig that does not answer.

    A new reason for the condition is logged at once. The same reason is logged again after intervals that
    double up to one hour. The log therefore stays short, even if the rig does not answer for a whole night.
    """

    def __init__(self, logger: logging.Logger, condition: str) -> None:
        self._logger = logger
        self._condition = condition
        self._reason = ""
        self._interval_s = 0.0
        self._next_s = 0.0

    def warn(self, reason: str, now_s: float) -> None:
        """Log the condition and its reason if a line is due."""
        if reason != self._reason:
            self._reason, self._interval_s = reason, FIRST_INTERVAL_S
        elif now_s < self._next_s:
            return
        else:
            self._interval_s = min(2 * self._interval_s, MAX_INTERVAL_S)
        self._next_s = now_s + self._interval_s
        self._logger.warning("%s: %s", self._condition, reason)

    def reset(self) -> None:
        """End the condition; the next warning is logged at once."""
        self._reason = ""
