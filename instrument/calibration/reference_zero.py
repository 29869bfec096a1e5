"""Zero of the reference sensor of a force calibration. A forgotten tare adds one force to all contacts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pneuforce.instrument.calibration.force import ForceCalibration, basis_of, expected_error_n
from pneuforce.instrument.calibration.least_squares import fit_linear

#: Largest apparent zero of honest contacts [N]. It differs from 0 because the correction does not fit the law
#: exactly. On simulated balloons, it exceeds this limit by less than `COVERAGE` standard uncertainties.
MAX_APPARENT_ZERO_N = 0.15
COVERAGE = 3.0
#: The zero is known only if the correction can have these terms, if the forces differ by this factor, and if
#: the standard uncertainty [N] is not larger. Otherwise, errors of the law look like a zero.
MIN_TERMS, MIN_FORCE_RATIO, MAX_STD_N = 4, 4.0, 0.1
MAX_STEPS, TOLERANCE_N = 20, 1e-4


class ApparentZero(NamedTuple):
    """Force [N] that all references seem to have in addition, and its standard uncertainty [N]."""

    zero_n: float
    std_n: float


def apparent_zero(calibration: ForceCalibration) -> ApparentZero:
    """Return the zero of a fit with the most terms, in which the zero is another coefficient.

    The fit minimises the weighted squares of F_ref − zero − F_law · exp(Σ b · basis), by Gauss–Newton steps.
    Both values are NaN if the contacts do not determine the zero.
    """
    contacts = calibration.contacts
    basis = basis_of(calibration.candidates[-1].terms, contacts)
    weights = 1 / expected_error_n(contacts)
    coefficients, zero_n = np.zeros(basis.shape[1]), 0.0
    for _ in range(MAX_STEPS):
        with np.errstate(over="ignore"):
            force_n = contacts.law_n * np.exp(basis @ coefficients)
        if not ((force_n > 1e-9) & (force_n < 1e9)).all():
            break
        columns = np.column_stack([np.ones(len(contacts)), force_n[:, None] * basis])
        try:
            fit = fit_linear(columns, contacts.force_n - zero_n - force_n, weights)
        except np.linalg.LinAlgError:
            break
        zero_n += fit.coefficients[0]
        coefficients = coefficients + fit.coefficients[1:]
        if abs(fit.coefficients[0]) < TOLERANCE_N:
            return ApparentZero(float(zero_n), float(fit.stds[0]))
    return ApparentZero(np.nan, np.nan)


def apparent_zero_warning(calibration: ForceCalibration) -> str:
    """Return a warning if the reference sensor was probably not set to zero, otherwise ""."""
    forces_n, terms = calibration.contacts.force_n, calibration.candidates[-1].terms
    if len(terms) < MIN_TERMS or forces_n.max() < MIN_FORCE_RATIO * forces_n.min():
        return ""
    zero_n, std_n = apparent_zero(calibration)
    if not std_n <= MAX_STD_N or not abs(zero_n) - COVERAGE * std_n > MAX_APPARENT_ZERO_N:
        return ""
    return (
        f"the contacts fit better if the reference sensor reads {zero_n:+.2f} ± {std_n:.2f} N without load: "
        "check its zero, and calibrate again"
    )
