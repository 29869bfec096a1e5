"""Largest and smallest valid force since the last reset."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(slots=True)
class ForceExtremes:
    """Maximum and minimum of all valid forces [N]. Both are NaN until a valid force was added."""

    maximum_n: float = math.nan
    minimum_n: float = math.nan

    def add(self, force_n: float) -> None:
        """Add the force of one sample. NaN is ignored."""
        if math.isnan(force_n):
            return
        if not force_n <= self.maximum_n:
            self.maximum_n = force_n
        if not force_n >= self.minimum_n:
            self.minimum_n = force_n
