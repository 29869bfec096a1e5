"""Trials: stretches in which the balloon was locked, its pressure beside a reference force."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator
from dataclasses import dataclass
from itertools import groupby
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

#: A longer gap between two samples ends a trial; a shorter trial than this tells nothing.
LONGEST_GAP_S = 0.1
SHORTEST_S = 0.5


class Sample(NamedTuple):
    """One sample of a recording."""

    t_s: float
    pressure_kpa: float  #: gauge, zeroed
    force_n: float  #: reference
    trial: Hashable  #: another one begins a new trial; None where the balloon is not locked


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """Samples of one locked balloon, in order of time."""

    t_s: Floats
    pressure_kpa: Floats
    force_n: Floats

    @property
    def steps_s(self) -> Floats:
        """Time since the sample before [s]; the first one's is the second's."""
        steps = np.diff(self.t_s, prepend=0.0)
        steps[0] = steps[1]
        return steps


def trials_of(rows: Iterable[Sample]) -> tuple[Trial, ...]:
    """The trials of a recording whose time rises."""
    return tuple(
        Trial(t_s=part[:, 0], pressure_kpa=part[:, 1], force_n=part[:, 2])
        for part in _locked(rows)
        if len(part) > 1 and part[-1, 0] - part[0, 0] > SHORTEST_S
    )


def _locked(rows: Iterable[Sample]) -> Iterator[Floats]:
    for trial, samples in groupby(rows, key=lambda row: row.trial):
        if trial is not None:
            part = np.array([row[:3] for row in samples])
            yield from np.split(part, np.flatnonzero(np.diff(part[:, 0]) > LONGEST_GAP_S) + 1)
