"""Protection of the event loop against exceptions in one handler."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any

log = logging.getLogger("pneuforce")


class CallGuard:
    """Wrapper for calls whose exceptions must not end the event loop. A repeated exception is logged once."""

    def __init__(self, consequence: str) -> None:
        """Set the log message, which states the consequence of a failed call."""
        self._consequence = consequence
        self._last_error = ""

    def __call__(self, handle: Callable[..., Any], *arguments: object) -> Any:
        """Return the result of `handle`, or None if it raises."""
        try:
            return handle(*arguments)
        except Exception as error:
            if repr(error) != self._last_error:
                self._last_error = repr(error)
                log.exception("%s", self._consequence)
            return None
