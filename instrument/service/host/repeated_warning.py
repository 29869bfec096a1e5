"""Warning about a condition that lasts, logged after growing pauses."""

from __future__ import annotations

import logging

from pneuforce.support.repeated_lines import RepeatedLines


class RepeatedWarning:
    """Logger for a condition that lasts, for example a rig that does not answer.

    A new reason for the condition is logged at once, and the same reason after the pauses of
    `RepeatedLines`. The log therefore stays short, even if the rig does not answer for a whole night.
    """

    def __init__(self, logger: logging.Logger, condition: str) -> None:
        self._logger = logger
        self._condition = condition
        self._reason = ""
        self._lines = RepeatedLines()

    def warn(self, reason: str, now_s: float) -> None:
        """Log the condition and its reason if a line is due."""
        if reason != self._reason:
            self.reset()
            self._reason = reason
        if self._lines.is_due(reason, now_s):
            self._logger.warning("%s: %s", self._condition, reason)

    def reset(self) -> None:
        """End the condition; the next warning is logged at once."""
        self._reason = ""
        self._lines.clear()
