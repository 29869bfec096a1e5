"""A log that a flood of bad requests cannot fill."""

from __future__ import annotations

import logging

LINES_PER_S = 5


class SparingLog:
    """Passes on a few lines per second, then says how many it held back."""

    def __init__(self, logger: logging.Logger) -> None:
        self._logger = logger
        self._second = float("-inf")
        self._lines = 0

    def say(self, now_s: float, message: str, *facts: object, trace: bool = False) -> None:
        """Log one line; with `trace`, the exception that is being handled too."""
        if now_s - self._second >= 1.0:
            if self._lines > LINES_PER_S:
                self._logger.warning("%d more lines were held back", self._lines - LINES_PER_S)
            self._second, self._lines = now_s, 0
        self._lines += 1
        if self._lines <= LINES_PER_S:
            self._logger.warning(message, *facts, exc_info=trace)
