"""Peaks of a trial as the instrument measures them: pressures in the balloon, without the lag of the tube."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pneuforce.instrument.measurement.lag import SAMPLE_S
from pneuforce.instrument.measurement.measurement import Measurement
from pneuforce.instrument.measurement.peak import Peak, PeakTracker
from pneuforce.instrument.validation.processed_trial import ProcessedTrial
from pneuforce.instrument.validation.trial import Floats, Trial

#: Half the time over which the reference force is averaged, because the largest of many noisy readings is too
#: large. The shortest estimate of a peak uses the same time.
AVERAGED_S = 0.032


class MeasuredPeak(NamedTuple):
    """Pressures and reference force of the peak of a contact."""

    baseline_kpa: float  #: ΔP_i
    final_kpa: float  #: ΔP_f
    reference_n: float  #: peak of the reference force


class TrialPeaks:
    """Peaks that the instrument measures in one trial, and the reference force without noise."""

    def __init__(self, processed: ProcessedTrial, tube_time_constant_s: float) -> None:
        self._processed = processed
        self._peaks = _track_peaks(processed, tube_time_constant_s)
        self._reference_n = average_force(processed.trial)

    def highest(self, samples: slice, reference: slice) -> MeasuredPeak:
        """Return the highest peak in a range of samples, and the reference force in another range.

        A very short contact has no peak. The highest pressure of its samples is used instead, as in the table
        of the contacts of a recording.
        """
        processed = self._processed
        baseline_kpa, now_kpa, t_s = processed.baseline_kpa, processed.now_kpa, processed.trial.t_s
        begin_s, end_s = t_s[samples.start], t_s[samples.stop - 1]
        peaks = [peak for peak in self._peaks if begin_s <= peak.t_s <= end_s]
        if peaks:
            best = max(peaks, key=lambda peak: peak.rise_kpa)
            at, rise_kpa = int(np.searchsorted(t_s, best.t_s)), best.rise_kpa
        else:
            at = samples.start + int(np.argmax(now_kpa[samples]))
            rise_kpa = float(now_kpa[at] - baseline_kpa[at])
        measured_kpa = float(baseline_kpa[at])
        return MeasuredPeak(measured_kpa, measured_kpa + rise_kpa, float(self._reference_n[reference].max()))


def _track_peaks(processed: ProcessedTrial, tube_time_constant_s: float) -> list[Peak]:
    """Return the peaks in order of time. Their forces are NaN.

    The tracker needs one reading for each sample of the board. Between two readings, the pressure is
    interpolated. At the end of the trial, the balloon is no longer locked, which ends a contact.
    """
    trial, tracker = processed.trial, PeakTracker(tube_time_constant_s)
    t_s = np.arange(trial.t_s[0], trial.t_s[-1], SAMPLE_S)
    at = np.searchsorted(trial.t_s, t_s, side="right") - 1
    columns = (
        t_s,
        np.interp(t_s, trial.t_s, trial.pressure_kpa),
        processed.baseline_kpa[at],
        (processed.now_kpa - processed.baseline_kpa)[at],
        processed.contact[at] > 0,
    )
    peaks: list[Peak] = []
    for time_s, unfiltered_kpa, baseline_kpa, rise_kpa, in_contact in zip(
        *(column.tolist() for column in columns), strict=True
    ):
        peaks += tracker.step(
            Measurement(
                t_s=time_s,
                unfiltered_kpa=unfiltered_kpa,
                baseline_kpa=baseline_kpa,
                rise_kpa=rise_kpa,
                in_contact=in_contact,
            )
        )
    unlocked = Measurement(t_s=float(t_s[-1]) + SAMPLE_S, unfiltered_kpa=float(trial.pressure_kpa[-1]))
    return [*peaks, *tracker.step(unlocked)]


def average_force(trial: Trial) -> Floats:
    """Return the reference force [N], averaged over ±`AVERAGED_S` with triangular weights."""
    half = round(AVERAGED_S / float(np.median(trial.steps_s)))
    weights = np.bartlett(2 * half + 3)[1:-1]
    padded = np.pad(trial.force_n, half, "edge")
    averaged: Floats = np.convolve(padded, weights / weights.sum(), "valid")
    return averaged
