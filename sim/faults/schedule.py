"""Faults on a schedule: each comes at its time and goes after its time."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from sim.faults.injection import Faults, checked


class Planned(NamedTuple):
    """One fault to come."""

    at_s: float
    for_s: float  #: math.inf where it stays
    name: str
    arguments: Mapping[str, float]


#: What happens at one time, in this order: what ends makes room for what begins, and nothing ends before
#: it has begun.
_GOES, _COMES, _GOES_AT_ONCE = range(3)


class Schedule:
    """A plan that is carried out as time passes. Of two faults of one name the later one counts."""

    def __init__(self, plan: Iterable[Planned]) -> None:
        """Raises Refused where a fault of the plan cannot be put in."""
        planned = [p._replace(arguments=checked(p.name, p.arguments)) for p in plan]
        comings = [(p.at_s, _COMES, p) for p in planned]
        goings = [(p.at_s + p.for_s, _goes(p), p) for p in planned if p.for_s < math.inf]
        self._due = sorted(comings + goings, key=lambda happening: happening[:2])
        self._latest: dict[str, Planned] = {}

    def step(self, faults: Faults, now_s: float) -> None:
        """Put in and take out what is due at `now_s`."""
        while self._due and self._due[0][0] <= now_s:
            _, happens, planned = self._due.pop(0)
            if happens == _COMES:
                self._latest[planned.name] = planned
                faults.put_in(planned.name, planned.arguments)
            elif self._latest[planned.name] is planned:
                faults.take_out(planned.name)


def _goes(planned: Planned) -> int:
    return _GOES if planned.at_s + planned.for_s > planned.at_s else _GOES_AT_ONCE
