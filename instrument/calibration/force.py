"""The force calibration: a `Correction` of least squares in the logarithm of the force, and which one.

Candidates of growing size are held against contacts that they have not seen (each left out in turn). The
smallest whose error is within one standard error of the least is taken; the bare law is a candidate too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from instrument.calibration.contacts import TURN_N, Contacts
from instrument.calibration.least_squares import Fit, fit
from instrument.chain import ChainSettings
from instrument.columns import Numbers
from instrument.errors import ConfigurationError
from instrument.model import estimate
from instrument.model.correction import MIDDLE_KPA, Correction

#: The terms of each candidate, names of fields of `Correction`.
CANDIDATES: tuple[tuple[str, ...], ...] = (
    ("constant",),
    ("constant", "by_rise"),
    ("constant", "by_rise", "by_initial"),
    ("constant", "by_rise", "by_initial", "by_both"),
    ("constant", "by_rise", "by_initial", "by_both", "by_step"),
)
#: What the coefficient of a term is multiplied by: L, p and w of `Correction`.
BASIS: Mapping[str, Callable[[Numbers, Numbers, Numbers], Numbers]] = {
    "constant": lambda L, p, w: np.ones_like(L),  # noqa: ARG005
    "by_rise": lambda L, p, w: L,  # noqa: ARG005
    "by_initial": lambda L, p, w: p,  # noqa: ARG005
    "by_both": lambda L, p, w: L * p,  # noqa: ARG005
    "by_step": lambda L, p, w: w,  # noqa: ARG005
}
POINTS_PER_TERM = 3
LEAST_POINTS = 6
#: A slope needs pressures and rises that differ; the step contacts on both sides of it.
LEAST_INITIAL_SPAN_KPA, LEAST_RISE_RATIO = 1.5, 1.5
#: A corrected law errs by about 3 % of the force, and 0.03 N below 1 N: against that the cell's error weighs.
EXPECTED = 0.03


@dataclass(frozen=True, slots=True)
class Candidate:
    """One size of correction, and the forces that it gives for contacts that it has not seen."""

    terms: tuple[str, ...]
    unseen_n: Numbers
    errors: Numbers  #: of those: as a share of the force above 1 N, in N below it

    @property
    def error(self) -> float:
        """Mean size of the errors."""
        return float(np.abs(self.errors).mean())

    def worse_than(self, best: Candidate) -> bool:
        """Whether it errs by more than one standard error more, on the same contacts."""
        more = self.errors**2 - best.errors**2
        return not more.mean() <= more.std(ddof=1) / math.sqrt(len(more))


@dataclass(frozen=True, slots=True)
class ForceCalibration:
    """The chosen correction and how it was chosen."""

    contacts: Contacts
    correction: Correction
    fit: Fit  #: coefficients in the order of `chosen.terms`
    chosen: Candidate
    candidates: tuple[Candidate, ...]  #: the bare law first


def calibration_of(contacts: Contacts, own: ChainSettings) -> ForceCalibration:
    """The correction that these contacts support, for the law of these settings.

    Raises ConfigurationError where they support none.
    """
    if len(contacts) < LEAST_POINTS:
        raise ConfigurationError(f"{len(contacts)} contacts, and at least {LEAST_POINTS} are needed")
    candidates = (_bare(contacts), *(_tried(terms, contacts, own) for terms in supported(contacts, own)))
    best = min(candidates, key=lambda candidate: float((candidate.errors**2).mean()))
    chosen = next(candidate for candidate in candidates if not candidate.worse_than(best))
    if not chosen.terms:
        raise ConfigurationError(
            f"no calibration: the bare law errs by {_percent(chosen.error)} on these contacts, the best "
            f"correction by {_percent(best.error)} on those that it has not seen, which is no better; "
            "nothing was written"
        )
    fitted = _fit(chosen.terms, contacts)
    correction = _correction(chosen.terms, fitted.coefficients, contacts, own)
    _check_growth(correction, own)
    return ForceCalibration(contacts, correction, fitted, chosen, candidates)


def supported(contacts: Contacts, own: ChainSettings) -> Iterator[tuple[str, ...]]:
    """The candidates that the contacts are enough for, in number and in spread."""
    told = {"constant"}
    if contacts.rise_kpa.max() >= LEAST_RISE_RATIO * contacts.rise_kpa.min():
        told |= {"by_rise"}
    if np.ptp(contacts.initial_kpa) >= LEAST_INITIAL_SPAN_KPA:
        told |= {"by_initial", "by_both"}
        above = int((contacts.small_strain > 0.5).sum())
        if own.law.method == "energetic" and POINTS_PER_TERM <= above <= len(contacts) - POINTS_PER_TERM:
            told |= {"by_step"}
    for terms in CANDIDATES:
        if told.issuperset(terms) and len(contacts) >= POINTS_PER_TERM * len(terms):
            yield terms


def error_of(force_n: Numbers, contacts: Contacts) -> Numbers:
    """Errors of forces: a share of the cell's above 1 N, newtons below it."""
    return (force_n - contacts.force_n) / np.maximum(contacts.force_n, TURN_N)


def _bare(contacts: Contacts) -> Candidate:
    return Candidate((), contacts.law_n, error_of(contacts.law_n, contacts))


def _tried(terms: tuple[str, ...], contacts: Contacts, own: ChainSettings) -> Candidate:
    unseen = np.array([_left_out(terms, contacts, own, n) for n in range(len(contacts))])
    return Candidate(terms, unseen, error_of(unseen, contacts))


def _left_out(terms: tuple[str, ...], contacts: Contacts, own: ChainSettings, n: int) -> float:
    """The force of contact `n` by what the others teach; infinite where they teach nothing."""
    seen = contacts.only(np.arange(len(contacts)) != n)
    try:
        correction = _correction(terms, _fit(terms, seen).coefficients, seen, own)
    except np.linalg.LinAlgError:
        return math.inf
    return float(contacts.law_n[n] * correction.factor(contacts.rise_kpa[n], contacts.initial_kpa[n]))


def _fit(terms: tuple[str, ...], contacts: Contacts) -> Fit:
    L, p = np.log(contacts.rise_kpa), contacts.initial_kpa - MIDDLE_KPA
    basis = np.stack([BASIS[term](L, p, contacts.small_strain) for term in terms], axis=1)
    weights = contacts.force_n / np.hypot(EXPECTED * np.maximum(contacts.force_n, TURN_N), contacts.std_n)
    return fit(basis, np.log(contacts.force_n / contacts.law_n), weights)


def _correction(
    terms: tuple[str, ...], coefficients: Numbers, contacts: Contacts, own: ChainSettings
) -> Correction:
    values = dict.fromkeys(CANDIDATES[-1], 0.0) | dict(zip(terms, coefficients.tolist(), strict=True))
    return Correction(
        rise_span_kpa=_span(contacts.rise_kpa),
        initial_span_kpa=_span(contacts.initial_kpa),
        law=own.law,
        balloon=own.balloon,
        **values,
    )


def _check_growth(correction: Correction, own: ChainSettings) -> None:
    """A harder press must never show a smaller force."""
    initial, rise = np.meshgrid(
        np.linspace(*correction.initial_span_kpa, 25), np.linspace(*correction.rise_span_kpa, 60)
    )
    law_n = estimate(initial, initial + rise, own.balloon, own.circuit, own.law).force_n
    falls = np.diff(law_n * correction.factor(rise, initial), axis=0) <= 0
    if falls.any():
        row, column = np.argwhere(falls)[0]
        raise ConfigurationError(
            f"no calibration: the corrected force would fall as the pressure rises, at ΔP_i = "
            f"{initial[row, column]:.2f} kPa and a rise of {rise[row, column]:.2f} kPa; are all forces right?"
        )


def _percent(error: float) -> str:
    return f"{100 * error:.1f} %"


def _span(values: Numbers) -> tuple[float, float]:
    return float(values.min()), float(values.max())
