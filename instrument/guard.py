"""A guard around calls of ours that must not end the loop: one frame, one beat, one record."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any

log = logging.getLogger("pneuforce")


class Guard:
    """Calls what it is given: what goes wrong in it costs no more than it, and is logged once."""

    def __init__(self, cost: str) -> None:
        """`cost` says in the log what is lost where something goes wrong."""
        self._cost = cost
        self._complaint = ""

    def __call__(self, handle: Callable[..., Any], *arguments: object) -> Any:
        """What `handle` returns, None where it fails."""
        try:
            return handle(*arguments)
        except Exception as error:
            if repr(error) != self._complaint:
                self._complaint = repr(error)
                log.exception("%s", self._cost)
            return None
