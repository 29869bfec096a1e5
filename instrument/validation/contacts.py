"""Contacts of a trial as the paper defines them: pressure before the peak, peak pressure, true peak force.

Section IV-B of the paper: ΔP_i is the lowest filtered pressure before the peak, ΔP_f is the highest filtered
pressure, and the true force is the peak of the filtered reference. The contact tracker of the instrument
finds the contacts. The errors of a configured instrument are those of its own peaks (`instrument_peaks.py`).
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.validation.instrument_peaks import MeasuredPeak, TrialPeaks
from pneuforce.instrument.validation.processed_trial import ProcessedTrial
from pneuforce.instrument.validation.trial import Floats


class EvaluatedContact(NamedTuple):
    """Pressures and reference force of one contact, with the times of both pressures."""

    baseline_kpa: float  #: ΔP_i
    final_kpa: float  #: ΔP_f
    force_n: float  #: peak of the filtered reference force
    initial_s: float  #: time of ΔP_i
    final_s: float  #: time of ΔP_f
    instrument: MeasuredPeak  #: the same contact, as the instrument measures it
    #: True if an object has pressed on the balloon since the start of the trial, so that ΔP_i is not the
    #: pressure of the free balloon
    cut: bool = False


def find_contacts(processed: ProcessedTrial, settings: ChainSettings) -> list[EvaluatedContact]:
    """Return the contacts of one trial in order of time."""
    tube_time_constant_s = settings.tube_time_constant_s
    peaks = TrialPeaks(processed, tube_time_constant_s)
    bounds = [*_trough_indices(processed), len(processed.trial.t_s)]
    return [
        _contact_between(processed, peaks, slice(*between), tube_time_constant_s)
        for between in pairwise(bounds)
    ]


def _trough_indices(processed: ProcessedTrial) -> list[int]:
    """Return the index of the lowest filtered pressure before the first peak, and between successive peaks.

    The peaks are found in the unfiltered pressure. The filtered pressure may still be falling when the
    tracker separates two overlapping contacts, and the lag-compensated pressure overshoots at sudden changes.
    """
    pressure_kpa = processed.trial.pressure_kpa
    peaks = [0, *(_index_of_maximum(pressure_kpa, span) for span in _contact_spans(processed))]
    return [start + int(np.argmin(processed.filtered_kpa[start : end + 1])) for start, end in pairwise(peaks)]


def _contact_spans(processed: ProcessedTrial) -> list[slice]:
    """Return the range of sample indices of each contact."""
    contact = processed.contact
    bounds = [0, *(np.flatnonzero(np.diff(contact)) + 1).tolist(), len(contact)]
    return [slice(start, end) for start, end in pairwise(bounds) if contact[start]]


def _index_of_maximum(values: Floats, span: slice) -> int:
    return int(span.start + np.argmax(values[span]))


def _contact_between(
    processed: ProcessedTrial, peaks: TrialPeaks, samples: slice, tube_time_constant_s: float
) -> EvaluatedContact:
    """Return the contact in the samples between two troughs.

    The reference force does not pass through the tube. Its troughs are therefore earlier by the lag.
    """
    t_s, pressure_kpa = processed.trial.t_s, processed.filtered_kpa
    start, end = samples.start, samples.stop
    peak = _index_of_maximum(pressure_kpa, samples)
    end_s = t_s[end] if end < len(t_s) else np.inf
    first, last = np.searchsorted(t_s, [t_s[start] - tube_time_constant_s, end_s - tube_time_constant_s])
    reference = slice(first, max(last, first + 1))
    return EvaluatedContact(
        float(pressure_kpa[start]),
        float(pressure_kpa[peak]),
        float(processed.filtered_n[reference].max()),
        float(t_s[start]),
        float(t_s[peak]),
        peaks.highest(samples, reference),
        cut=not processed.was_free[first],
    )
