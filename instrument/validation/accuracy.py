"""Accuracy of force estimators on contacts of known force, and the coverage of their stated uncertainty."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from pneuforce.instrument.calibration.contacts import CalibrationContacts
from pneuforce.instrument.calibration.residuals import force_residual
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.model.curve import ContactCurve
from pneuforce.instrument.model.pressure_bins import BIN_COUNT, pressure_bin_indices
from pneuforce.instrument.model.uncertainty import force_std_n
from pneuforce.instrument.model.uncertainty_budget import CONTACT_S
from pneuforce.support.columns import Numbers


class AccuracyScore(NamedTuple):
    """Errors of one estimator over a group of contacts. A value without contacts is NaN."""

    mean_percent: float  #: mean absolute relative error of the forces from 1 to 3.5 N
    rmse_n: float  #: root mean square error of the forces below 1 N
    coverage_percent: float  #: share of the contacts whose absolute error is at most 2u


class EstimatorScores(NamedTuple):
    """Errors of one estimator: over all contacts, and in each pressure bin."""

    name: str
    all: AccuracyScore
    by_pressure: tuple[AccuracyScore, ...]
    fast: AccuracyScore | None = None  #: all contacts once more, as sudden contacts; None: not evaluated


def score_estimators(
    contacts: CalibrationContacts, estimators: Mapping[str, Sequence[ChainSettings]]
) -> list[EstimatorScores]:
    """Return the errors of each estimator.

    `estimators` maps the name of each estimator to its settings. If an estimator has several settings, for
    example several calibrations, their errors are averaged.
    """
    return [_score_estimator(name, contacts, settings) for name, settings in estimators.items()]


def _score_estimator(
    name: str, contacts: CalibrationContacts, settings: Sequence[ChainSettings]
) -> EstimatorScores:
    estimates = [_forces(contacts, each) for each in settings]
    bins = pressure_bin_indices(contacts.baseline_kpa)
    masks = [np.ones(len(contacts), bool), *(bins == index for index in range(BIN_COUNT))]
    means = [
        AccuracyScore(
            *np.mean(
                [_score(contacts.select(mask), force_n[mask], std_n[mask]) for force_n, std_n in estimates],
                axis=0,
            )
        )
        for mask in masks
    ]
    return EstimatorScores(name, means[0], tuple(means[1:]))


def _score(contacts: CalibrationContacts, force_n: Numbers, std_n: Numbers) -> AccuracyScore:
    residual = force_residual(force_n, contacts)
    covered = np.abs(force_n - contacts.force_n) <= 2 * np.hypot(std_n, contacts.std_n)
    return AccuracyScore(residual.mean_error_percent, residual.rmse_n, 100 * float(covered.mean()))


def _forces(contacts: CalibrationContacts, settings: ChainSettings) -> tuple[Numbers, Numbers]:
    """Return force and standard uncertainty [N] of each contact, for constant pressures."""
    finals_kpa = contacts.baseline_kpa + contacts.rise_kpa
    return estimate_forces(zip(contacts.baseline_kpa, finals_kpa, strict=True), settings)


def estimate_forces(
    pressures_kpa: Iterable[tuple[float, float]], settings: ChainSettings, contact_s: float = CONTACT_S
) -> tuple[Numbers, Numbers]:
    """Return force and standard uncertainty [N] for each pair of constant pressures ΔP_i and ΔP_f.

    `contact_s` is the time since a sudden contact.
    """
    rows = [
        _force(curve, rise_kpa, contact_s, settings) for curve, rise_kpa in _curves(pressures_kpa, settings)
    ]
    forces, stds = np.array(rows).reshape(-1, 2).T
    return forces, stds


def largest_rises_kpa(pressures_kpa: Iterable[tuple[float, float]], settings: ChainSettings) -> Numbers:
    """Return, for each pair of ΔP_i and ΔP_f, the rise [kPa] above which the balloon may be pressed flat."""
    return np.array([curve.largest_rise_kpa for curve, _ in _curves(pressures_kpa, settings)])


def _curves(
    pressures_kpa: Iterable[tuple[float, float]], settings: ChainSettings
) -> Iterator[tuple[ContactCurve, float]]:
    """Yield the force curve of each pair of pressures, and its rise [kPa]."""
    model, curve = settings.force_model, None
    for baseline_kpa, final_kpa in pressures_kpa:
        if curve is None or curve.baseline_kpa != baseline_kpa:  # pairs of one contact share their curve
            curve = ContactCurve(
                float(baseline_kpa), model, settings.correction, settings.input_uncertainties
            )
        yield curve, float(final_kpa - baseline_kpa)


def _force(
    curve: ContactCurve, rise_kpa: float, contact_s: float, settings: ChainSettings
) -> tuple[float, float]:
    inputs, baseline_kpa = settings.input_uncertainties, curve.baseline_kpa
    point = curve.at(rise_kpa)
    pressures = inputs.after_step(baseline_kpa, baseline_kpa + rise_kpa, contact_s)
    force_n = point.estimate.force_n
    std_n = force_std_n(force_n, point.sensitivity, pressures, inputs, settings.model_uncertainty)
    return force_n, std_n
