"""Moving average of the supply voltage. A single conversion of the bandgap resolves only 22 mV."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

#: Number of conversions in the average (32 ms). With noise or ripple of at least one step, the average
#: resolves 22 mV / 16.
SUPPLY_SAMPLES = 16


@dataclass(slots=True)
class SupplyMonitor:
    """Average voltage of the supply of sensor, ADC and relays."""

    mean_mv: int = 0  #: mean of the last 16 samples, or of all samples if there are fewer
    _history_mv: deque[int] = field(default_factory=lambda: deque(maxlen=SUPPLY_SAMPLES))

    def step(self, supply_mv: int) -> None:
        """Add one sample."""
        self._history_mv.append(supply_mv)
        self.mean_mv = sum(self._history_mv) // len(self._history_mv)
