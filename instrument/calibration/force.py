"""Fit of the force calibration: a `ForceCorrection` by least squares in the logarithm of the force.

Candidates of growing size are compared by leave-one-out cross-validation: each contact is predicted by a fit
without this contact. The smallest candidate whose error is within one standard error of the lowest error is
chosen. The uncalibrated law is a candidate too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.calibration.contacts import RELATIVE_ERROR_MIN_N, CalibrationContacts
from pneuforce.instrument.calibration.least_squares import LinearFit, fit_linear
from pneuforce.instrument.calibration.plausibility import check_force
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.model.correction import REFERENCE_BASELINE_KPA, ForceCorrection
from pneuforce.support.columns import Numbers
from pneuforce.support.counted import counted

#: Terms of each candidate. The terms are names of fields of `ForceCorrection`.
CANDIDATES: tuple[tuple[str, ...], ...] = (
    ("constant",),
    ("constant", "by_rise"),
    ("constant", "by_rise", "by_initial"),
    ("constant", "by_rise", "by_initial", "by_both"),
    ("constant", "by_rise", "by_initial", "by_both", "by_step"),
)
#: Basis function of each term. Its arguments are L, p and w, which `ForceCorrection` defines.
BASIS: Mapping[str, Callable[[Numbers, Numbers, Numbers], Numbers]] = {
    "constant": lambda L, p, w: np.ones_like(L),  # noqa: ARG005
    "by_rise": lambda L, p, w: L,  # noqa: ARG005
    "by_initial": lambda L, p, w: p,  # noqa: ARG005
    "by_both": lambda L, p, w: L * p,  # noqa: ARG005
    "by_step": lambda L, p, w: w,  # noqa: ARG005
}
MIN_POINTS_PER_TERM = 3
MIN_CONTACTS = 6
#: The terms with ΔP_i need contacts whose ΔP_i differ by at least this span [kPa]. The terms with the rise
#: need contacts whose largest rise is at least this multiple of the smallest rise.
MIN_BASELINE_SPAN_KPA, MIN_RISE_RATIO = 1.5, 1.5
#: Typical error of a corrected law: 3 % of the force, and 0.03 N below 1 N. The weight of a contact depends
#: on this error and on the uncertainty of the reference sensor.
EXPECTED_ERROR = 0.03


@dataclass(frozen=True, slots=True)
class CorrectionCandidate:
    """Terms of a possible correction, and the cross-validated forces of a correction with these terms."""

    terms: tuple[str, ...]
    held_out_n: Numbers  #: force of each contact, predicted by a fit without this contact
    errors: Numbers  #: errors of `held_out_n`: relative above 1 N, in N below

    @property
    def error(self) -> float:
        """Return the mean absolute error."""
        return float(np.abs(self.errors).mean())

    def worse_than(self, best: CorrectionCandidate) -> bool:
        """Return True if the mean square error exceeds that of `best` by more than one standard error.

        This is the standard error of the mean difference between the squared errors of both candidates.
        """
        difference = self.errors**2 - best.errors**2
        return not difference.mean() <= difference.std(ddof=1) / math.sqrt(len(difference))


@dataclass(frozen=True, slots=True)
class ForceCalibration:
    """Chosen correction, and the candidates that it was chosen from."""

    contacts: CalibrationContacts
    correction: ForceCorrection
    fit: LinearFit  #: coefficients in the order of `chosen.terms`
    chosen: CorrectionCandidate
    candidates: tuple[CorrectionCandidate, ...]  #: the uncalibrated law is the first


def fit_force(contacts: CalibrationContacts, settings: ChainSettings) -> ForceCalibration:
    """Return the correction that the contacts support, for the force law of the settings.

    Raises ConfigurationError if there are too few contacts, if no candidate is better than the uncalibrated
    law, or if the corrected force is implausible.
    """
    if len(contacts) < MIN_CONTACTS:
        raise ConfigurationError(
            f"{counted(len(contacts), 'contact')}, and at least {MIN_CONTACTS} are needed"
        )
    corrected = (_cross_validate(terms, contacts, settings) for terms in supported_terms(contacts, settings))
    candidates = (_uncalibrated(contacts), *corrected)
    best = min(candidates, key=lambda candidate: float((candidate.errors**2).mean()))
    chosen = next(candidate for candidate in candidates if not candidate.worse_than(best))
    if not chosen.terms:
        raise ConfigurationError(
            "no calibration: no correction is clearly better than the uncalibrated law; on these contacts "
            f"the uncalibrated law has a mean error of {_percent(chosen.error)}, and the best correction has "
            f"{_percent(best.error)} on held-out contacts; nothing was written"
        )
    fit = _fit(chosen.terms, contacts)
    correction = _correction(chosen.terms, fit.coefficients, contacts, settings)
    try:
        check_force(replace(settings, correction=correction))
    except ConfigurationError as error:
        raise ConfigurationError(f"no calibration: {error}; nothing was written") from None
    return ForceCalibration(contacts, correction, fit, chosen, candidates)


def supported_terms(contacts: CalibrationContacts, settings: ChainSettings) -> Iterator[tuple[str, ...]]:
    """Yield the terms of each candidate for which there are enough contacts with different pressures."""
    usable = {"constant"}
    if contacts.rise_kpa.max() >= MIN_RISE_RATIO * contacts.rise_kpa.min():
        usable |= {"by_rise"}
    if np.ptp(contacts.baseline_kpa) >= MIN_BASELINE_SPAN_KPA:
        usable |= {"by_initial", "by_both"}
        above_step = int((contacts.small_strain_weight > 0.5).sum())
        below_step = len(contacts) - above_step
        if settings.law.method == "energetic" and min(above_step, below_step) >= MIN_POINTS_PER_TERM:
            usable |= {"by_step"}
    for terms in CANDIDATES:
        if usable.issuperset(terms) and len(contacts) >= MIN_POINTS_PER_TERM * len(terms):
            yield terms


def scaled_errors(force_n: Numbers, contacts: CalibrationContacts) -> Numbers:
    """Return the errors of the forces: as a share of the reference force above 1 N, in newtons below."""
    return (force_n - contacts.force_n) / np.maximum(contacts.force_n, RELATIVE_ERROR_MIN_N)


def _uncalibrated(contacts: CalibrationContacts) -> CorrectionCandidate:
    return CorrectionCandidate((), contacts.law_n, scaled_errors(contacts.law_n, contacts))


def _cross_validate(
    terms: tuple[str, ...], contacts: CalibrationContacts, settings: ChainSettings
) -> CorrectionCandidate:
    held_out_n = np.array([_held_out_force_n(terms, contacts, settings, n) for n in range(len(contacts))])
    return CorrectionCandidate(terms, held_out_n, scaled_errors(held_out_n, contacts))


def _held_out_force_n(
    terms: tuple[str, ...], contacts: CalibrationContacts, settings: ChainSettings, held_out: int
) -> float:
    """Return the force of the contact `held_out`, predicted by a fit of the other contacts.

    The force is infinite if the other contacts do not determine the coefficients.
    """
    others = contacts.select(np.arange(len(contacts)) != held_out)
    try:
        correction = _correction(terms, _fit(terms, others).coefficients, others, settings)
    except np.linalg.LinAlgError:
        return math.inf
    factor = correction.factor(contacts.rise_kpa[held_out], contacts.baseline_kpa[held_out])
    return float(contacts.law_n[held_out] * factor)


def _fit(terms: tuple[str, ...], contacts: CalibrationContacts) -> LinearFit:
    values = np.log(contacts.force_n / contacts.law_n)
    return fit_linear(basis_of(terms, contacts), values, contacts.force_n / expected_error_n(contacts))


def basis_of(terms: tuple[str, ...], contacts: CalibrationContacts) -> Numbers:
    """Return the basis functions of the terms at each contact, of shape (contacts, terms)."""
    L, p = np.log(contacts.rise_kpa), contacts.baseline_kpa - REFERENCE_BASELINE_KPA
    return np.stack([BASIS[term](L, p, contacts.small_strain_weight) for term in terms], axis=1)


def expected_error_n(contacts: CalibrationContacts) -> Numbers:
    """Return the typical error of each contact [N], with the uncertainty of its reference force."""
    corrected_n = EXPECTED_ERROR * np.maximum(contacts.force_n, RELATIVE_ERROR_MIN_N)
    return np.hypot(corrected_n, contacts.std_n)


def _correction(
    terms: tuple[str, ...], coefficients: Numbers, contacts: CalibrationContacts, settings: ChainSettings
) -> ForceCorrection:
    values = dict.fromkeys(CANDIDATES[-1], 0.0) | dict(zip(terms, coefficients.tolist(), strict=True))
    return ForceCorrection(
        rise_span_kpa=_span(contacts.rise_kpa),
        baseline_span_kpa=_span(contacts.baseline_kpa),
        law=settings.law,
        balloon=settings.balloon,
        **values,
    )


def _percent(error: float) -> str:
    return f"{100 * error:.1f} %"


def _span(values: Numbers) -> tuple[float, float]:
    return float(values.min()), float(values.max())
