"""How good the peak forces of a recording are, by the pressure that the balloon was inflated to."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from statistics import fmean
from typing import NamedTuple

import numpy as np

from instrument.fifths import COUNT, EDGES_KPA, fifths_of
from instrument.model.balloon import LOWEST_RISE_KPA
from instrument.tape.contacts import ContactRow
from instrument.validation.peaks import LEAST_FORCE_N
from instrument.validation.trial import Floats


class Bar(NamedTuple):
    """One fifth of the validated range."""

    name: str
    contacts: int
    percent: float  #: NaN without contacts


class Reference(NamedTuple):
    """What a force cell read, on the clock of the recording."""

    t_s: Floats
    force_n: Floats

    def peak_n(self, row: ContactRow) -> float:
        """Its greatest force during a contact; NaN where it read nothing then."""
        end_s = row.begin_s + row.duration_s
        first, last = np.searchsorted(self.t_s, [row.initial_s, end_s + 1e-9])
        return float(self.force_n[first:last].max()) if first < last else math.nan


def uncertainties(rows: Iterable[ContactRow]) -> tuple[Bar, ...]:
    """Mean relative standard uncertainty of the peak force in each fifth [%]."""
    return _bars(appreciable(rows), lambda row: 100 * row.peak_std_n / row.peak_n)


def errors(rows: Iterable[ContactRow], reference: Reference) -> tuple[Bar, ...]:
    """Mean absolute error over the reference's own peak in each fifth [%], where it felt the contact."""
    felt = {row: reference.peak_n(row) for row in appreciable(rows)}
    felt = {row: true_n for row, true_n in felt.items() if true_n >= LEAST_FORCE_N}
    return _bars(list(felt), lambda row: 100 * abs(row.peak_n - felt[row]) / felt[row])


def appreciable(rows: Iterable[ContactRow]) -> list[ContactRow]:
    """Contacts that are over, with a force and a rise of at least 0.5 kPa, as the paper evaluates them."""
    return [
        row
        for row in rows
        if not row.open and row.peak_n > 0 and row.final_kpa - row.initial_kpa >= LOWEST_RISE_KPA
    ]


def _bars(rows: Sequence[ContactRow], percent_of: Callable[[ContactRow], float]) -> tuple[Bar, ...]:
    fifths = fifths_of(np.array([row.initial_kpa for row in rows], float))
    bars = []
    for n in range(COUNT):
        found = [percent_of(row) for row, fifth in zip(rows, fifths, strict=True) if fifth == n]
        name = f"{EDGES_KPA[n]:.2f}–{EDGES_KPA[n + 1]:.2f}"
        bars.append(Bar(name, len(found), fmean(found) if found else math.nan))
    return tuple(bars)
