"""Errors and uncertainties of the peak forces of a recording, in each pressure bin of ΔP_i."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from statistics import fmean
from typing import NamedTuple

import numpy as np

from pneuforce.instrument.model.balloon import MIN_RISE_KPA
from pneuforce.instrument.model.pressure_bins import BIN_COUNT, BIN_EDGES_KPA, pressure_bin_indices
from pneuforce.instrument.recording.contacts import ContactRow
from pneuforce.instrument.validation.trial import MIN_FORCE_N, Floats

MAX_PERCENT = 1e6  #: a contact with a larger or an unknown relative value is not counted


class BinMean(NamedTuple):
    """Mean of a quantity over the contacts in one pressure bin."""

    name: str
    contacts: int
    percent: float  #: mean value; NaN without contacts


class ReferenceForce(NamedTuple):
    """Readings of a reference force sensor, on the clock of the recording."""

    t_s: Floats
    force_n: Floats

    def peak_n(self, row: ContactRow) -> float:
        """Return the highest force during a contact, NaN if there is no reading during the contact."""
        end_s = row.begin_s + row.duration_s
        first, last = np.searchsorted(self.t_s, [row.initial_s, end_s + 1e-9])
        return float(self.force_n[first:last].max()) if first < last else math.nan


def uncertainty_by_bin(rows: Iterable[ContactRow]) -> tuple[BinMean, ...]:
    """Return the mean relative standard uncertainty of the peak force in each bin [%]."""
    return _bin_means(evaluable(rows), lambda row: 100 * row.peak_std_n / row.peak_n)


def error_by_bin(rows: Iterable[ContactRow], reference: ReferenceForce) -> tuple[BinMean, ...]:
    """Return the mean absolute error of the peak force in each bin, relative to the reference peak [%].

    Contacts with a reference peak below `MIN_FORCE_N` are excluded.
    """
    reference_n = {row: reference.peak_n(row) for row in evaluable(rows)}
    reference_n = {row: peak_n for row, peak_n in reference_n.items() if peak_n >= MIN_FORCE_N}
    return _bin_means(
        list(reference_n), lambda row: 100 * abs(row.peak_n - reference_n[row]) / reference_n[row]
    )


def evaluable(rows: Iterable[ContactRow]) -> list[ContactRow]:
    """Return the complete contacts with a force and a rise of at least 0.5 kPa, as the paper selects them."""
    return [
        row
        for row in rows
        if not (row.open or row.cut) and row.peak_n > 0 and row.final_kpa - row.baseline_kpa >= MIN_RISE_KPA
    ]


def _bin_means(rows: Sequence[ContactRow], percent_of: Callable[[ContactRow], float]) -> tuple[BinMean, ...]:
    bins = pressure_bin_indices(np.array([row.baseline_kpa for row in rows], float))
    means = []
    for index in range(BIN_COUNT):
        percents = [percent_of(row) for row, bin_index in zip(rows, bins, strict=True) if bin_index == index]
        values = [percent for percent in percents if percent <= MAX_PERCENT]
        name = f"{BIN_EDGES_KPA[index]:.2f}–{BIN_EDGES_KPA[index + 1]:.2f}"
        means.append(BinMean(name, len(values), fmean(values) if values else math.nan))
    return tuple(means)
