"""How long to wait before a bus that has failed is opened anew."""

from __future__ import annotations

import math
from dataclasses import dataclass

FIRST_S, LONGEST_S = 0.1, 2.0
WELL_S = 5.0  #: of an open bus, after which the next failure is a new one


@dataclass(slots=True)
class BackOff:
    """A wait that doubles with each attempt, and begins anew once an opened bus has stayed well."""

    wait_s: float = FIRST_S
    _opened_s: float = -math.inf

    def tried(self) -> None:
        """Hear of an attempt: the next comes later."""
        self.wait_s = min(2 * self.wait_s, LONGEST_S)

    def opened(self, now_s: float) -> None:
        """Hear that the bus is open."""
        self._opened_s = now_s

    def failed(self, now_s: float) -> None:
        """Hear that the open bus has failed."""
        if now_s - self._opened_s > WELL_S:
            self.wait_s = FIRST_S
