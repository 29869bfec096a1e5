"""The course of a trial as the instrument follows it: the chain's own parts, sample by sample."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from instrument.chain import ChainSettings
from instrument.contact import ContactTracker
from instrument.lag import SAMPLE_S, LagCompensator
from instrument.validation.trial import Floats, Trial


class Course(NamedTuple):
    """Arrays of one length, a value for each sample of the trial."""

    trial: Trial
    filtered_kpa: Floats  #: the pressure behind the first-order exponential filter
    filtered_n: Floats  #: the reference behind the same filter
    now_kpa: Floats  #: in the balloon: the tube's lag undone
    initial_kpa: Floats  #: ΔP_i of the contact in progress, else the baseline
    contact: NDArray[np.int64]  #: number of the contact in progress from 1, 0 without contact


def courses_of(trials: Iterable[Trial], settings: ChainSettings) -> Iterator[Course]:
    """The course of each trial; nothing is remembered from one to the next."""
    lag = LagCompensator(settings.tube_s)
    for trial in trials:
        lag.step(math.nan, SAMPLE_S)
        yield Course(
            trial,
            exponential(trial.pressure_kpa, trial.steps_s, settings.filter_s),
            exponential(trial.force_n, trial.steps_s, settings.filter_s),
            *_tracked(trial, lag),
        )


def _tracked(trial: Trial, lag: LagCompensator) -> tuple[Floats, Floats, NDArray[np.int64]]:
    tracker = ContactTracker()
    now_kpa, initial_kpa = np.empty((2, len(trial.t_s)))
    contact = np.zeros(len(trial.t_s), dtype=np.int64)
    samples = zip(trial.pressure_kpa.tolist(), trial.steps_s.tolist(), strict=True)
    for n, (reading_kpa, dt_s) in enumerate(samples):
        now_kpa[n] = pressure_kpa = lag.step(reading_kpa, dt_s)
        tracker.step(lag.calm_kpa, pressure_kpa, True, dt_s)
        initial_kpa[n] = tracker.initial_kpa
        contact[n] = tracker.count if tracker.in_contact else 0
    return now_kpa, initial_kpa, contact


def exponential(values: Floats, steps_s: Floats, filter_s: float) -> Floats:
    """Values behind a first-order exponential filter that begins with the first of them."""
    shares = (-np.expm1(-steps_s / filter_s)).tolist()
    filtered, now = [], float(values[0])
    for value, share in zip(values.tolist(), shares, strict=True):
        now += share * (value - now)
        filtered.append(now)
    return np.array(filtered)
