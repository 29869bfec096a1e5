"""Trials: periods in which the balloon was locked, with pressure and reference force."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator
from dataclasses import dataclass
from itertools import groupby
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

#: Longest gap between two samples of a trial. A longer gap ends the trial.
MAX_GAP_S = 0.1
#: Shortest duration of a trial. A shorter trial is ignored.
MIN_DURATION_S = 0.5

#: Lowest reference force of a pressed balloon [N]. If the peak of the reference is lower, the reference
#: sensor has not measured the contact.
MIN_FORCE_N = 0.05


class TrialSample(NamedTuple):
    """One sample of a recording."""

    t_s: float
    pressure_kpa: float  #: gauge, zeroed
    force_n: float  #: reference force
    #: Label of the trial, None if the balloon is not locked. A different label starts a new trial.
    trial: Hashable


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """Samples of one trial in order of time, as arrays of equal length."""

    t_s: Floats
    pressure_kpa: Floats
    force_n: Floats

    @property
    def steps_s(self) -> Floats:
        """Return the time since the previous sample [s]. The first element repeats the second."""
        steps = np.diff(self.t_s, prepend=0.0)
        steps[0] = steps[1]
        return steps


def split_trials(samples: Iterable[TrialSample]) -> tuple[Trial, ...]:
    """Return the trials of a recording. The time must rise from sample to sample."""
    return tuple(
        Trial(t_s=part[:, 0], pressure_kpa=part[:, 1], force_n=part[:, 2])
        for part in _locked_parts(samples)
        if len(part) > 1 and part[-1, 0] - part[0, 0] > MIN_DURATION_S
    )


def _locked_parts(samples: Iterable[TrialSample]) -> Iterator[Floats]:
    """Yield the samples of each trial as an array of shape (samples, 3): time, pressure, force."""
    for trial, group in groupby(samples, key=lambda sample: sample.trial):
        if trial is not None:
            part = np.array([sample[:3] for sample in group])
            yield from np.split(part, np.flatnonzero(np.diff(part[:, 0]) > MAX_GAP_S) + 1)
