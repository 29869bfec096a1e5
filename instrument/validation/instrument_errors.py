"""Errors of the force that an instrument with its calibration computes for the contacts of a validation."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.validation.accuracy import estimate_forces
from pneuforce.instrument.validation.instrument_peaks import MeasuredPeak
from pneuforce.instrument.validation.paper import GROUPS, ContactGroup
from pneuforce.instrument.validation.peaks import PeakForces
from pneuforce.instrument.validation.trial import Floats


class InstrumentErrors(NamedTuple):
    """Errors of the instrument over one group of contacts. A value without contacts is NaN."""

    group: str
    contacts: int
    solved: int  #: contacts for which the instrument shows a force
    absolute: float  #: mean absolute relative error [%]
    signed: float  #: mean relative error [%]
    rmse_n: float  #: root mean square error
    within_u_percent: float  #: share of the contacts whose absolute error is at most u
    within_2u_percent: float  #: share of the contacts whose absolute error is at most 2u


def instrument_errors(
    peaks: PeakForces,
    measured: Sequence[MeasuredPeak],
    settings: ChainSettings,
    groups: Iterable[ContactGroup] = GROUPS,
) -> tuple[InstrumentErrors, ...]:
    """Return the errors of each group of contacts, in the order of the groups.

    `measured` contains the pressures and the reference force of each contact in `peaks`. The groups are
    those of the paper, and follow from `peaks`.
    """
    force_n, std_n = estimate_forces([peak[:2] for peak in measured], settings)
    reference_n = np.array([peak.reference_n for peak in measured])
    return tuple(_errors_of_group(group, peaks, reference_n, force_n, std_n) for group in groups)


def _errors_of_group(
    group: ContactGroup, peaks: PeakForces, reference_n: Floats, force_n: Floats, std_n: Floats
) -> InstrumentErrors:
    members = group.selects(peaks.baseline_kpa, peaks.volume_change, peaks.force_n)
    solved = members & np.isfinite(force_n + std_n)
    count, error_n = int(members.sum()), (force_n - reference_n)[solved]
    if not len(error_n):
        return InstrumentErrors(group.name, count, 0, *[np.nan] * 5)
    percent = 100 * error_n / reference_n[solved]
    return InstrumentErrors(
        group.name,
        count,
        len(error_n),
        float(np.mean(np.abs(percent))),
        float(np.mean(percent)),
        float(np.sqrt(np.mean(error_n**2))),
        float(100 * np.mean(np.abs(error_n) <= std_n[solved])),
        float(100 * np.mean(np.abs(error_n) <= 2 * std_n[solved])),
    )
