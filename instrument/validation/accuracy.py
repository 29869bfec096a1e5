"""How far each estimator is from the truth on contacts of known force; whether ±2u holds the truth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from instrument.calibration.columns import Numbers
from instrument.calibration.contacts import Contacts
from instrument.calibration.residuals import figures
from instrument.chain import ChainSettings
from instrument.model.balloon import VALID_HIGH_KPA, VALID_LOW_KPA
from instrument.model.curve import ContactCurve
from instrument.model.uncertainty import Pressures, std_n

BINS = 5
EDGES_KPA = np.linspace(VALID_LOW_KPA, VALID_HIGH_KPA, BINS + 1)


class Errors(NamedTuple):
    """Errors of one estimator on some contacts; NaN where there are none of the kind."""

    mean_percent: float  #: mean absolute error of forces from 1 to 3.5 N
    rmse_n: float  #: of forces below 1 N
    held_percent: float  #: contacts whose truth lies within ±2u


class Estimator(NamedTuple):
    """One way to a force, and its errors: over all contacts, and by fifths of the pressures."""

    name: str
    all: Errors
    by_pressure: tuple[Errors, ...]


def evaluated(contacts: Contacts, estimators: Mapping[str, Sequence[ChainSettings]]) -> list[Estimator]:
    """Errors of each estimator: settings under a name; several, such as calibrations, are averaged."""
    return [_of(name, contacts, settings) for name, settings in estimators.items()]


def _of(name: str, contacts: Contacts, settings: Sequence[ChainSettings]) -> Estimator:
    each = [_forces(contacts, own) for own in settings]
    fifth = np.clip(np.searchsorted(EDGES_KPA, contacts.initial_kpa) - 1, 0, BINS - 1)
    groups = [np.ones(len(contacts), bool), *(fifth == n for n in range(BINS))]
    means = [
        Errors(*np.mean([_errors(contacts.only(g), force[g], std[g]) for force, std in each], axis=0))
        for g in groups
    ]
    return Estimator(name, means[0], tuple(means[1:]))


def _errors(contacts: Contacts, force_n: Numbers, std: Numbers) -> Errors:
    found = figures(force_n, contacts)
    held = np.abs(force_n - contacts.force_n) <= 2 * np.hypot(std, contacts.std_n)
    return Errors(found.mean_error_percent, found.rmse_n, 100 * float(held.mean()))


def _forces(contacts: Contacts, own: ChainSettings) -> tuple[Numbers, Numbers]:
    """Force and standard uncertainty [N] of each contact, as the live chain would state them at rest."""
    pairs = [_force(p, rise, own) for p, rise in zip(contacts.initial_kpa, contacts.rise_kpa, strict=True)]
    forces, stds = np.array(pairs).T
    return forces, stds


def _force(initial_kpa: float, rise_kpa: float, own: ChainSettings) -> tuple[float, float]:
    initial, rise = float(initial_kpa), float(rise_kpa)
    curve = ContactCurve(initial, own.balloon, own.circuit, own.law, own.correction, own.errors)
    point = curve.at(rise)
    known = Pressures(initial, initial + rise, own.errors.noise_kpa, own.errors.noise_kpa)
    force_n = point.estimate.force_n
    return force_n, std_n(force_n, point.spread, known, own.errors, own.model, own.balloon)
