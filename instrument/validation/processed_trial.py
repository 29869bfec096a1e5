"""Trials processed as in the live instrument: filter, lag compensation and contact tracking per sample."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.measurement.contact import ContactTracker
from pneuforce.instrument.measurement.lag import SAMPLE_S, LagCompensator
from pneuforce.instrument.validation.trial import MIN_FORCE_N, Bools, Floats, Trial


class ProcessedTrial(NamedTuple):
    """Trial and its processed signals, as arrays with one element for each sample."""

    trial: Trial
    filtered_kpa: Floats  #: pressure after the first-order exponential filter
    filtered_n: Floats  #: reference force after the same filter
    now_kpa: Floats  #: pressure in the balloon, with the lag of the tube compensated
    baseline_kpa: Floats  #: ΔP_i of the contact in progress; without contact, the current baseline
    contact: NDArray[np.int64]  #: number of the contact in progress, from 1; 0 without contact

    @property
    def was_free(self) -> Bools:
        """Return a mask of the samples at or after the first sample without a reference force.

        If an object presses on the balloon when the trial begins, the baseline is the pressure of the pressed
        balloon until the object is removed.
        """
        pressed: Bools = np.fmin.accumulate(self.filtered_n) >= MIN_FORCE_N
        return ~pressed


def process_trials(trials: Iterable[Trial], settings: ChainSettings) -> Iterator[ProcessedTrial]:
    """Yield each trial with its processed signals. No state is carried from one trial to the next."""
    lag = LagCompensator(settings.tube_time_constant_s)
    for trial in trials:
        lag.step(math.nan, SAMPLE_S)  # NaN restarts the compensator
        yield ProcessedTrial(
            trial,
            exponential_filter(trial.pressure_kpa, trial.steps_s, settings.filter_time_constant_s),
            exponential_filter(trial.force_n, trial.steps_s, settings.filter_time_constant_s),
            *_track(trial, lag),
        )


def _track(trial: Trial, lag: LagCompensator) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """Return the pressure in the balloon, the baseline and the contact number of each sample."""
    tracker = ContactTracker()
    now_kpa, baseline_kpa = np.empty((2, len(trial.t_s)))
    contact = np.zeros(len(trial.t_s), dtype=np.int64)
    samples = zip(trial.pressure_kpa.tolist(), trial.steps_s.tolist(), strict=True)
    for n, (reading_kpa, dt_s) in enumerate(samples):
        now_kpa[n] = pressure_kpa = lag.step(reading_kpa, dt_s)
        tracker.step(lag.smoothed_kpa, pressure_kpa, True, dt_s)
        baseline_kpa[n] = tracker.baseline_kpa
        contact[n] = tracker.contact_count if tracker.in_contact else 0
    return now_kpa, baseline_kpa, contact


def exponential_filter(values: Floats, steps_s: Floats, filter_time_constant_s: float) -> Floats:
    """Return the values after a first-order exponential filter, which starts at the first value.

    `steps_s` is the time from the previous value to each value [s].
    """
    gains = (-np.expm1(-steps_s / filter_time_constant_s)).tolist()
    filtered, state = [], float(values[0])
    for value, gain in zip(values.tolist(), gains, strict=True):
        state += gain * (value - state)
        filtered.append(state)
    return np.array(filtered)
