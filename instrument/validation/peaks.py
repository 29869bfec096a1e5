"""Errors of the peak force: estimates of every method for each contact, compared with the reference."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, get_args

import numpy as np

from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.model import Balloon, Circuit, estimate
from pneuforce.instrument.model.balloon import (
    MIN_RISE_KPA,
    VALID_HIGH_KPA,
    VALID_LOW_KPA,
    sphere_volume_mm3,
)
from pneuforce.instrument.model.law import PublishedMethod
from pneuforce.instrument.validation.contacts import EvaluatedContact
from pneuforce.instrument.validation.instrument_peaks import MeasuredPeak
from pneuforce.instrument.validation.paper import GROUPS, HYSTERESIS_KPA, ContactGroup
from pneuforce.instrument.validation.trial import MIN_FORCE_N, Bools, Floats

METHODS: tuple[PublishedMethod, ...] = get_args(PublishedMethod)


class ContactCounts(NamedTuple):
    """Numbers of contacts that were found, excluded and evaluated.

    An excluded contact is counted only under the first reason that applies.
    """

    found: int
    cut: int  #: pressed since the start of the trial, so that ΔP_i is not that of the free balloon
    too_small: int  #: rise below 0.5 kPa, which the paper excludes too
    out_of_range: int  #: ΔP_i outside the validated range by more than the hysteresis
    without_force: int  #: reference peak below `MIN_FORCE_N`
    evaluated: int


@dataclass(frozen=True, slots=True)
class PeakForces:
    """Evaluated contacts, as arrays of equal length."""

    baseline_kpa: Floats
    final_kpa: Floats
    force_n: Floats  #: reference force
    #: ΔV/V_i = (1 − P_i/P_f)·V_i/V_si. The pressures are absolute. V_i is the volume of circuit and
    #: sphere before the contact. V_si is the volume of the sphere alone.
    volume_change: Floats
    estimates_n: Mapping[PublishedMethod, Floats]  #: estimated force by method; NaN if there is no solution
    instrument: tuple[MeasuredPeak, ...] = ()  #: the same contacts, as the instrument measures them

    @property
    def filtered(self) -> tuple[MeasuredPeak, ...]:
        """Return the contacts as the paper measures them, from filtered signals."""
        return tuple(map(MeasuredPeak, self.baseline_kpa, self.final_kpa, self.force_n))

    def errors_percent(self, method: PublishedMethod) -> Floats:
        """Return the relative error of each contact [%]."""
        return 100 * (self.estimates_n[method] - self.force_n) / self.force_n


class MethodErrors(NamedTuple):
    """Errors of one method over a group of contacts."""

    solved: int  #: contacts for which the method has a solution
    absolute_percent: float  #: mean absolute error; NaN without contacts
    signed_percent: float  #: mean error; NaN without contacts
    published_percent: float | None  #: mean absolute error in the paper, None if it is not in the paper


class GroupErrors(NamedTuple):
    """Errors of every method over one group of contacts."""

    name: str
    contacts: int
    by_method: Mapping[PublishedMethod, MethodErrors]


def select_peaks(
    contacts: Sequence[EvaluatedContact], settings: ChainSettings
) -> tuple[PeakForces, ContactCounts]:
    """Return the contacts that can be evaluated, and the numbers of evaluated and excluded contacts."""
    baseline, final, force = np.array([contact[:3] for contact in contacts], float).reshape(-1, 3).T
    cut = np.array([contact.cut for contact in contacts], bool)
    too_small = ~cut & (final - baseline < MIN_RISE_KPA)
    out_of_range = ~cut & ~too_small & ~_in_range(baseline)
    without_force = ~cut & ~too_small & ~out_of_range & ~(force >= MIN_FORCE_N)
    evaluated = ~(cut | too_small | out_of_range | without_force)
    masks = (cut, too_small, out_of_range, without_force, evaluated)
    counts = ContactCounts(len(contacts), *(int(mask.sum()) for mask in masks))
    peaks = estimate_peaks(baseline[evaluated], final[evaluated], force[evaluated], settings)
    measured = tuple(contact.instrument for contact, used in zip(contacts, evaluated, strict=True) if used)
    return replace(peaks, instrument=measured), counts


def _in_range(baseline_kpa: Floats) -> Bools:
    low_kpa, high_kpa = VALID_LOW_KPA - HYSTERESIS_KPA, VALID_HIGH_KPA + HYSTERESIS_KPA
    return (low_kpa < baseline_kpa) & (baseline_kpa <= high_kpa)


def estimate_peaks(
    baseline_kpa: Floats, final_kpa: Floats, force_n: Floats, settings: ChainSettings
) -> PeakForces:
    """Return the contacts with the force that each method estimates from their pressures."""
    balloon, circuit = settings.balloon, settings.circuit
    estimates = {
        method: estimate(
            baseline_kpa, final_kpa, balloon, circuit, replace(settings.law, method=method)
        ).force_n
        for method in METHODS
    }
    change = volume_change(baseline_kpa, final_kpa, balloon, circuit)
    return PeakForces(baseline_kpa, final_kpa, force_n, change, estimates)


def volume_change(baseline_kpa: Floats, final_kpa: Floats, balloon: Balloon, circuit: Circuit) -> Floats:
    """Return ΔV/V_i: the decrease of the gas volume, divided by the volume of the sphere (Section IV-B)."""
    sphere_mm3 = sphere_volume_mm3(balloon.radius_mm(baseline_kpa))
    remaining = (circuit.ambient_kpa + baseline_kpa) / (circuit.ambient_kpa + final_kpa)
    change: Floats = (1 - remaining) * (circuit.volume_mm3 + sphere_mm3) / sphere_mm3
    return change


def group_errors(peaks: PeakForces, groups: Iterable[ContactGroup] = GROUPS) -> tuple[GroupErrors, ...]:
    """Return the errors of each group of contacts, in the order of the groups."""
    return tuple(_errors_of_group(peaks, group) for group in groups)


def _errors_of_group(peaks: PeakForces, group: ContactGroup) -> GroupErrors:
    members = group.selects(peaks.baseline_kpa, peaks.volume_change, peaks.force_n)
    by_method = {
        method: _method_errors(peaks.errors_percent(method)[members], group.published_percent.get(method))
        for method in METHODS
    }
    return GroupErrors(group.name, int(members.sum()), by_method)


def _method_errors(percent: Floats, published_percent: float | None) -> MethodErrors:
    known = percent[np.isfinite(percent)]
    if not len(known):
        return MethodErrors(0, np.nan, np.nan, published_percent)
    return MethodErrors(len(known), float(np.mean(np.abs(known))), float(np.mean(known)), published_percent)
