"""How far each estimator is from the truth on contacts of known force; whether ±2u holds the truth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from instrument.calibration.contacts import Contacts
from instrument.calibration.residuals import residual_of
from instrument.chain import ChainSettings
from instrument.columns import Numbers
from instrument.fifths import COUNT, fifths_of
from instrument.model.budget import CONTACT_S
from instrument.model.curve import ContactCurve
from instrument.model.uncertainty import std_n


class Score(NamedTuple):
    """Errors of one estimator on some contacts; NaN where there are none of the kind."""

    mean_percent: float  #: mean absolute error of forces from 1 to 3.5 N
    rmse_n: float  #: of forces below 1 N
    held_percent: float  #: contacts whose truth lies within ±2u


class Estimator(NamedTuple):
    """One way to a force, and its errors: over all contacts, and by fifths of the pressures."""

    name: str
    all: Score
    by_pressure: tuple[Score, ...]


def scored(contacts: Contacts, estimators: Mapping[str, Sequence[ChainSettings]]) -> list[Estimator]:
    """Errors of each estimator: settings under a name; several, such as calibrations, are averaged."""
    return [_of(name, contacts, settings) for name, settings in estimators.items()]


def _of(name: str, contacts: Contacts, settings: Sequence[ChainSettings]) -> Estimator:
    each = [_forces(contacts, own) for own in settings]
    fifths = fifths_of(contacts.initial_kpa)
    groups = [np.ones(len(contacts), bool), *(fifths == n for n in range(COUNT))]
    means = [
        Score(*np.mean([_score(contacts.only(g), force[g], std[g]) for force, std in each], axis=0))
        for g in groups
    ]
    return Estimator(name, means[0], tuple(means[1:]))


def _score(contacts: Contacts, force_n: Numbers, std: Numbers) -> Score:
    found = residual_of(force_n, contacts)
    held = np.abs(force_n - contacts.force_n) <= 2 * np.hypot(std, contacts.std_n)
    return Score(found.mean_error_percent, found.rmse_n, 100 * float(held.mean()))


def _forces(contacts: Contacts, own: ChainSettings) -> tuple[Numbers, Numbers]:
    """Force and standard uncertainty [N] of each contact, as the live chain would state them at rest."""
    pairs = [_force(p, rise, own) for p, rise in zip(contacts.initial_kpa, contacts.rise_kpa, strict=True)]
    forces, stds = np.array(pairs).T
    return forces, stds


def _force(initial_kpa: float, rise_kpa: float, own: ChainSettings) -> tuple[float, float]:
    initial, rise = float(initial_kpa), float(rise_kpa)
    curve = ContactCurve(initial, own.balloon, own.circuit, own.law, own.correction, own.errors)
    point = curve.at(rise)
    known = own.errors.at_rest(initial, initial + rise, CONTACT_S)
    force_n = point.estimate.force_n
    return force_n, std_n(force_n, point.spread, known, own.errors, own.model, own.balloon)
