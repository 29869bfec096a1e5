"""How long to wait before what has failed is tried anew."""

from __future__ import annotations

import math
from dataclasses import dataclass, field


@dataclass(slots=True)
class BackOff:
    """A wait that doubles with each attempt, and begins anew once what was opened has stayed well."""

    first_s: float
    longest_s: float
    well_s: float  #: after so long the next failure is a new one
    wait_s: float = field(init=False)
    _opened_s: float = -math.inf

    def __post_init__(self) -> None:
        self.wait_s = self.first_s

    def tried(self) -> None:
        """Hear of an attempt: the next comes later."""
        self.wait_s = min(2 * self.wait_s, self.longest_s)

    def opened(self, now_s: float) -> None:
        """Hear that it is open."""
        self._opened_s = now_s

    def failed(self, now_s: float) -> bool:
        """Hear that it has failed; whether it had been well."""
        if well := now_s - self._opened_s > self.well_s:
            self.wait_s = self.first_s
        return well
