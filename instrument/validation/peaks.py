"""Peak forces: what each method makes of the pressures of each contact, and how far off that is."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, get_args

import numpy as np

from instrument.chain import ChainSettings
from instrument.model import Balloon, Circuit, estimate
from instrument.model.balloon import LOWEST_RISE_KPA, VALID_HIGH_KPA, VALID_LOW_KPA, sphere_volume
from instrument.model.law import MethodName
from instrument.validation.contacts import PickedContact
from instrument.validation.paper import GROUPS, HYSTERESIS_KPA, Group
from instrument.validation.trial import Bools, Floats

METHODS: tuple[MethodName, ...] = get_args(MethodName)
#: A peak of the reference below this is no contact with it [N].
LEAST_FORCE_N = 0.05


class Counts(NamedTuple):
    """What became of the contacts; the first reason that applies counts."""

    found: int
    too_small: int  #: a rise below 0.5 kPa, which the paper excludes
    out_of_range: int  #: ΔP_i outside the range that the paper validated, by more than the hysteresis
    without_force: int  #: the reference felt nothing
    evaluated: int


@dataclass(frozen=True, slots=True)
class Peaks:
    """The contacts that are evaluated, as arrays of one length."""

    initial_kpa: Floats
    final_kpa: Floats
    force_n: Floats  #: reference
    volume_change: Floats  #: ΔV/V_i = (1 − P_i/P_f)·V_i/V_si, absolute pressures, V_si the sphere's
    estimates_n: Mapping[MethodName, Floats]  #: by method; NaN where the method has no solution

    def errors_percent(self, method: MethodName) -> Floats:
        """Error of each contact over its reference [%]."""
        return 100 * (self.estimates_n[method] - self.force_n) / self.force_n


class MethodErrors(NamedTuple):
    """Errors of one method over a group of contacts."""

    solved: int  #: contacts for which the method has a solution
    absolute_percent: float  #: mean absolute error, NaN without contacts
    signed_percent: float  #: mean error
    printed_percent: float | None  #: the paper's mean absolute error, where it prints one


class GroupErrors(NamedTuple):
    """Errors of every method over one group."""

    name: str
    contacts: int
    by_method: Mapping[MethodName, MethodErrors]


def peaks_kept(contacts: Sequence[PickedContact], settings: ChainSettings) -> tuple[Peaks, Counts]:
    """The contacts that the paper would evaluate, and what became of the others."""
    initial, final, force = np.array([contact[:3] for contact in contacts], float).reshape(-1, 3).T
    small = final - initial < LOWEST_RISE_KPA
    outside = ~small & ~_in_range(initial)
    silent = ~small & ~outside & ~(force >= LEAST_FORCE_N)
    good = ~(small | outside | silent)
    counts = Counts(len(contacts), *(int(part.sum()) for part in (small, outside, silent, good)))
    return peaks_of(initial[good], final[good], force[good], settings), counts


def _in_range(initial_kpa: Floats) -> Bools:
    low_kpa, high_kpa = VALID_LOW_KPA - HYSTERESIS_KPA, VALID_HIGH_KPA + HYSTERESIS_KPA
    return (low_kpa < initial_kpa) & (initial_kpa <= high_kpa)


def peaks_of(initial_kpa: Floats, final_kpa: Floats, force_n: Floats, settings: ChainSettings) -> Peaks:
    """The contacts between these pressures, estimated by every method."""
    balloon, circuit = settings.balloon, settings.circuit
    estimates = {
        method: estimate(
            initial_kpa, final_kpa, balloon, circuit, replace(settings.law, method=method)
        ).force_n
        for method in METHODS
    }
    change = volume_change(initial_kpa, final_kpa, balloon, circuit)
    return Peaks(initial_kpa, final_kpa, force_n, change, estimates)


def volume_change(initial_kpa: Floats, final_kpa: Floats, balloon: Balloon, circuit: Circuit) -> Floats:
    """ΔV/V_i, by how much of its sphere the gas of the whole circuit is compressed (Section IV-B)."""
    sphere_mm3 = sphere_volume(balloon.radius_mm(initial_kpa))
    left = (circuit.ambient_kpa + initial_kpa) / (circuit.ambient_kpa + final_kpa)
    change: Floats = (1 - left) * (circuit.volume_mm3 + sphere_mm3) / sphere_mm3
    return change


def errors_of(peaks: Peaks, groups: Iterable[Group] = GROUPS) -> tuple[GroupErrors, ...]:
    """The errors of each group of contacts, in order."""
    return tuple(_group(peaks, group) for group in groups)


def _group(peaks: Peaks, group: Group) -> GroupErrors:
    chosen = group.selects(peaks.initial_kpa, peaks.volume_change, peaks.force_n)
    by_method = {
        method: _errors(peaks.errors_percent(method)[chosen], group.printed.get(method)) for method in METHODS
    }
    return GroupErrors(group.name, int(chosen.sum()), by_method)


def _errors(percent: Floats, printed_percent: float | None) -> MethodErrors:
    known = percent[np.isfinite(percent)]
    if not len(known):
        return MethodErrors(0, np.nan, np.nan, printed_percent)
    return MethodErrors(len(known), float(np.mean(np.abs(known))), float(np.mean(known)), printed_percent)
