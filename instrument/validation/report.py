"""The report of a validation: figures of this recording beside those that the paper prints."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

from instrument.chain import ChainSettings
from instrument.model.balloon import LOWEST_RISE_KPA
from instrument.validation import paper
from instrument.validation.contacts import PickedContact, contacts_of
from instrument.validation.continuous import Continuous, Forces, continuous, forces_of
from instrument.validation.course import Course, courses_of
from instrument.validation.peaks import Counts, GroupErrors, Peaks, errors_of, peaks_kept
from instrument.validation.trial import Trial


class Seen(NamedTuple):
    """One trial, its contacts and its forces: what the figures show."""

    course: Course
    contacts: list[PickedContact]
    forces: Forces

    @property
    def appreciable(self) -> list[PickedContact]:
        """The contacts that the paper would not exclude: a rise of 0.5 kPa at least."""
        return [c for c in self.contacts if c.final_kpa - c.initial_kpa >= LOWEST_RISE_KPA]


class VolumeChange(NamedTuple):
    """ΔV/V_i above 8.85 kPa; NaN without contacts there."""

    least: float
    most: float
    mean: float


class Report(NamedTuple):
    """All that a validation says."""

    trials: int
    counts: Counts
    groups: tuple[GroupErrors, ...]
    volume_change: VolumeChange
    continuous: Continuous


def seen(trials: Iterable[Trial], settings: ChainSettings) -> list[Seen]:
    """Each trial as the instrument follows it."""
    return [
        Seen(course, contacts_of(course, settings), forces_of(course, settings))
        for course in courses_of(trials, settings)
    ]


def report_of(trials: list[Seen], settings: ChainSettings) -> tuple[Report, Peaks]:
    """The report, and the contacts that it is about."""
    peaks, counts = peaks_kept([contact for trial in trials for contact in trial.contacts], settings)
    report = Report(
        len(trials),
        counts,
        errors_of(peaks),
        _volume_change(peaks),
        continuous([trial.forces for trial in trials]),
    )
    return report, peaks


def _volume_change(peaks: Peaks) -> VolumeChange:
    change = peaks.volume_change[paper.STIFF.selects(peaks.initial_kpa, peaks.volume_change, peaks.force_n)]
    if not len(change):
        return VolumeChange(math.nan, math.nan, math.nan)
    return VolumeChange(float(change.min()), float(change.max()), float(change.mean()))


def as_tables(report: Report) -> dict[str, Any]:
    """The report for JSON: null for what there is not."""
    own, printed = report.continuous, paper.VOLUME_CHANGE
    return {
        "trials": report.trials,
        "contacts": report.counts._asdict(),
        "paper_contacts": paper.CONTACTS,
        "peak_errors_percent": [_group(group) for group in report.groups],
        "volume_change": _known(report.volume_change._asdict() | {"paper": list(printed)}),
        "continuous": _known(own._asdict() | {"paper_n": paper.RMSE_N, "paper_shift_s": paper.SHIFT_S}),
    }


def _group(group: GroupErrors) -> dict[str, Any]:
    methods: dict[str, Any] = {
        method: _known(
            {
                "solved": errors.solved,
                "absolute": errors.absolute_percent,
                "signed": errors.signed_percent,
                "paper": errors.printed_percent,
            }
        )
        for method, errors in group.by_method.items()
    }
    return {"group": group.name, "count": group.contacts, **methods}


def _known(table: dict[str, Any]) -> dict[str, Any]:
    return {
        name: None if isinstance(value, float) and not math.isfinite(value) else value
        for name, value in table.items()
    }
