"""Schedule that injects each fault at its time and removes it after its duration."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from pneuforce.sim.faults.injection import FaultInjector, validate_arguments


class ScheduledFault(NamedTuple):
    """Fault with start time and duration."""

    start_s: float
    duration_s: float  #: math.inf if the fault is not removed
    name: str
    arguments: Mapping[str, float]


#: Order of actions that are due at the same time. Faults that end are removed before new faults are injected.
#: A fault of zero duration is removed after its injection.
_REMOVE, _INJECT, _REMOVE_AT_ONCE = range(3)


class FaultSchedule:
    """Schedule of faults.

    If two scheduled faults have the same name, the later fault replaces the earlier fault.
    """

    def __init__(self, faults: Iterable[ScheduledFault]) -> None:
        """Validate and sort the faults. Raises SimulatorRequestError if a fault is invalid."""
        valid = [f._replace(arguments=validate_arguments(f.name, f.arguments)) for f in faults]
        injections = [(f.start_s, _INJECT, f) for f in valid]
        removals = [(f.start_s + f.duration_s, _removal(f), f) for f in valid if f.duration_s < math.inf]
        self._due = sorted(injections + removals, key=lambda action: action[:2])
        self._latest: dict[str, ScheduledFault] = {}

    def step(self, injector: FaultInjector, now_s: float) -> None:
        """Inject and remove the faults that are due at `now_s`."""
        while self._due and self._due[0][0] <= now_s:
            _, action, fault = self._due.pop(0)
            if action == _INJECT:
                self._latest[fault.name] = fault
                injector.inject(fault.name, fault.arguments)
            elif self._latest[fault.name] is fault:
                injector.remove(fault.name)


def _removal(fault: ScheduledFault) -> int:
    """Return the action that removes a fault. A duration that rounds to zero needs `_REMOVE_AT_ONCE`."""
    return _REMOVE if fault.start_s + fault.duration_s > fault.start_s else _REMOVE_AT_ONCE
