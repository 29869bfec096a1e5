"""Report by exception: selection of the metrics that have changed since their last publication."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from pneuforce.registers.sparkplug import METRICS, Value

_ANALOG = {metric.name: metric.unit for metric in METRICS if metric.is_analog}


@dataclass(slots=True)
class ChangeFilter:
    """Filter of snapshots.

    A text, a number without a unit, and the validity of a value are published at once. A measured value is
    published at most once per period, and only after a change by more than the deadband of its unit.
    """

    period_s: float
    deadbands: Mapping[str, float]  #: deadband of each unit; a unit without a deadband has 0
    _published: dict[str, Value] = field(default_factory=dict)
    _due_s: float = -math.inf

    def restart(self, values: Mapping[str, Value]) -> None:
        """Take `values` as published, because a birth message contained them."""
        self._published = dict(values)

    def changes(self, values: Mapping[str, Value], now_s: float) -> dict[str, Value]:
        """Return the values to publish now; empty if nothing has changed or the period has not ended."""
        changed = {name: value for name, value in values.items() if self._has_changed(name, value)}
        urgent = any(self._is_urgent(name, value) for name, value in changed.items())
        if not changed or not (urgent or now_s >= self._due_s):
            return {}
        self._due_s = now_s + self.period_s
        self._published |= changed
        return changed

    def _has_changed(self, name: str, value: Value) -> bool:
        if name not in self._published:
            return True
        last = self._published[name]
        if name in _ANALOG and isinstance(value, float) and isinstance(last, float):
            return abs(value - last) > self.deadbands.get(_ANALOG[name], 0.0)
        return value != last

    def _is_urgent(self, name: str, value: Value) -> bool:
        return name not in _ANALOG or value is None or self._published.get(name) is None
