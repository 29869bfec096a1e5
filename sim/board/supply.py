"""The supply as a mean: one conversion of the bandgap knows it to a step of 22 mV only."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

#: Conversions in a mean, 32 ms. Where noise or ripple moves one by a step, the mean knows 22 mV / 16.
SUPPLY_SAMPLES = 16


@dataclass(slots=True)
class Supply:
    """What supplies sensor, ADC and relays."""

    mean_mv: int = 0  #: of the last 16 samples, or as many as there were
    _past_mv: deque[int] = field(default_factory=lambda: deque(maxlen=SUPPLY_SAMPLES))

    def step(self, supply_mv: int) -> None:
        """One sample later."""
        self._past_mv.append(supply_mv)
        self.mean_mv = sum(self._past_mv) // len(self._past_mv)
