"""A log that a flood of bad requests cannot fill."""

from __future__ import annotations

import logging

MOST_LINES = 5


class SparingLog:
    """Passes on a few lines per second, or another period, then says how many it held back."""

    def __init__(self, logger: logging.Logger, period_s: float = 1.0) -> None:
        self._logger = logger
        self._period_s = period_s
        self._begun_s = float("-inf")
        self._lines = 0

    def say(self, now_s: float, message: str, *facts: object, trace: bool = False) -> None:
        """Log one line; with `trace`, the exception that is being handled too."""
        if now_s - self._begun_s >= self._period_s:
            if self._lines > MOST_LINES:
                self._logger.warning("%d more lines were held back", self._lines - MOST_LINES)
            self._begun_s, self._lines = now_s, 0
        self._lines += 1
        if self._lines <= MOST_LINES:
            self._logger.warning(message, *facts, exc_info=trace)
