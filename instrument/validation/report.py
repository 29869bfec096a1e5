"""Validation report: the results of a recording, compared with the results of the paper."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.model.balloon import MIN_RISE_KPA
from pneuforce.instrument.validation import paper
from pneuforce.instrument.validation.contacts import EvaluatedContact, find_contacts
from pneuforce.instrument.validation.continuous import (
    ContinuousErrors,
    TrialForces,
    compute_forces,
    continuous_errors,
)
from pneuforce.instrument.validation.instrument_errors import InstrumentErrors
from pneuforce.instrument.validation.peaks import (
    ContactCounts,
    GroupErrors,
    PeakForces,
    group_errors,
    select_peaks,
)
from pneuforce.instrument.validation.processed_trial import ProcessedTrial, process_trials
from pneuforce.instrument.validation.trial import Trial


class TrialEvaluation(NamedTuple):
    """One trial with its contacts and its forces, as the figures show them."""

    processed: ProcessedTrial
    contacts: list[EvaluatedContact]
    forces: TrialForces

    @property
    def evaluable_contacts(self) -> list[EvaluatedContact]:
        """Return the complete contacts with a rise of 0.5 kPa or more, as in the paper."""
        return [c for c in self.contacts if not c.cut and c.final_kpa - c.baseline_kpa >= MIN_RISE_KPA]


class VolumeChange(NamedTuple):
    """ΔV/V_i of the contacts above 8.85 kPa. The values are NaN if there are no such contacts."""

    min: float
    max: float
    mean: float


class ValidationReport(NamedTuple):
    """Results of a validation."""

    trials: int
    counts: ContactCounts
    groups: tuple[GroupErrors, ...]
    volume_change: VolumeChange
    continuous: ContinuousErrors
    instrument: tuple[InstrumentErrors, ...] = ()  #: errors of a configured instrument; empty without one


def evaluate_trials(trials: Iterable[Trial], settings: ChainSettings) -> list[TrialEvaluation]:
    """Return the contacts and the forces of each trial."""
    return [
        TrialEvaluation(processed, find_contacts(processed, settings), compute_forces(processed, settings))
        for processed in process_trials(trials, settings)
    ]


def build_report(
    trials: list[TrialEvaluation], settings: ChainSettings
) -> tuple[ValidationReport, PeakForces]:
    """Return the report, and the peak forces of the contacts that the report evaluates."""
    peaks, counts = select_peaks([contact for trial in trials for contact in trial.contacts], settings)
    report = ValidationReport(
        len(trials),
        counts,
        group_errors(peaks),
        _volume_change(peaks),
        continuous_errors([trial.forces for trial in trials]),
    )
    return report, peaks


def _volume_change(peaks: PeakForces) -> VolumeChange:
    members = paper.ABOVE_SWITCH.selects(peaks.baseline_kpa, peaks.volume_change, peaks.force_n)
    change = peaks.volume_change[members]
    if not len(change):
        return VolumeChange(math.nan, math.nan, math.nan)
    return VolumeChange(float(change.min()), float(change.max()), float(change.mean()))


def report_to_json(report: ValidationReport) -> dict[str, Any]:
    """Return the report as a JSON object. A value that is not available is null."""
    continuous = report.continuous._asdict() | {"paper_n": paper.RMSE_N, "paper_shift_s": paper.SHIFT_S}
    return {
        "trials": report.trials,
        "contacts": report.counts._asdict(),
        "paper_contacts": paper.CONTACT_COUNT,
        "peak_errors_percent": [_group_to_json(group) for group in report.groups],
        "volume_change": _nan_to_none(report.volume_change._asdict() | {"paper": list(paper.VOLUME_CHANGE)}),
        "continuous": _nan_to_none(continuous),
        "instrument_errors": [_nan_to_none(errors._asdict()) for errors in report.instrument],
    }


def _group_to_json(group: GroupErrors) -> dict[str, Any]:
    methods: dict[str, Any] = {
        method: _nan_to_none(
            {
                "solved": errors.solved,
                "absolute": errors.absolute_percent,
                "signed": errors.signed_percent,
                "paper": errors.published_percent,
            }
        )
        for method, errors in group.by_method.items()
    }
    return {"group": group.name, "count": group.contacts, **methods}


def _nan_to_none(table: dict[str, Any]) -> dict[str, Any]:
    return {
        name: None if isinstance(value, float) and not math.isfinite(value) else value
        for name, value in table.items()
    }
