"""Errors of a force calibration on held-out contacts, as the calibration file states them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pneuforce.instrument.calibration.contacts import RELATIVE_ERROR_MIN_N, CalibrationContacts
from pneuforce.instrument.model.pressure_bins import BIN_EDGES_KPA, pressure_bin_indices
from pneuforce.support.columns import Numbers

RELATIVE_ERROR_MAX_N = 3.5  #: highest force in the paper


class ForceResidual(NamedTuple):
    """Difference between forces and the reference sensor. Without contacts, each value is NaN."""

    rmse_n: float  #: root mean square error of the forces below 1 N
    mean_error_percent: float  #: mean absolute error of the forces from 1 to 3.5 N


class BinErrors(NamedTuple):
    """Errors of the contacts from 1 to 3.5 N in one pressure bin."""

    low_kpa: float
    high_kpa: float
    contacts: int
    before_percent: float  #: mean absolute error of the uncalibrated law
    after_percent: float  #: mean absolute error of the calibration on held-out contacts


class ContactResidual(NamedTuple):
    """One contact of a force calibration. The estimate comes from a fit without this contact."""

    line: int  #: line of the contact in its file
    baseline_kpa: float
    rise_kpa: float
    reference_n: float
    law_n: float  #: force of the uncalibrated law
    estimate_n: float  #: force of the calibration
    difference_n: float  #: estimate minus reference
    std_n: float  #: standard uncertainty of the difference

    @property
    def ratio(self) -> float:
        """Return the absolute difference as a multiple of its standard uncertainty."""
        return abs(self.difference_n) / self.std_n


def contact_residuals(
    held_out_n: Numbers, contacts: CalibrationContacts, lines: Sequence[int]
) -> list[ContactResidual]:
    """Return the residual of each contact, in the order of the file. `lines` are the lines of the file."""
    share, floor_n = share_and_floor(held_out_n, contacts)
    std_n = np.sqrt((share * contacts.force_n) ** 2 + floor_n**2)
    columns = (
        contacts.baseline_kpa,
        contacts.rise_kpa,
        contacts.force_n,
        contacts.law_n,
        held_out_n,
        held_out_n - contacts.force_n,
        std_n,
    )
    rows = zip(*(column.tolist() for column in columns), strict=True)
    return [ContactResidual(line, *row) for line, row in zip(lines, rows, strict=True)]


def force_residual(force_n: Numbers, contacts: CalibrationContacts) -> ForceResidual:
    """Return the errors of the forces, one force per contact."""
    reference_n = contacts.force_n
    error_n = force_n - reference_n
    rmse_n = math.sqrt(_mean(error_n[reference_n < RELATIVE_ERROR_MIN_N] ** 2))
    relative = np.abs(error_n / reference_n)[in_relative_range(contacts)]
    return ForceResidual(rmse_n, 100 * _mean(relative))


def in_relative_range(contacts: CalibrationContacts) -> NDArray[np.bool_]:
    """Return a mask of the contacts from 1 to 3.5 N, whose errors are stated in percent."""
    return (contacts.force_n >= RELATIVE_ERROR_MIN_N) & (contacts.force_n <= RELATIVE_ERROR_MAX_N)


def errors_by_pressure(held_out_n: Numbers, contacts: CalibrationContacts) -> list[BinErrors]:
    """Return the mean errors before and after the calibration, in each pressure bin that has contacts."""
    bins, errors = pressure_bin_indices(contacts.baseline_kpa), []
    for index, (low_kpa, high_kpa) in enumerate(pairwise(BIN_EDGES_KPA)):
        inside = (bins == index) & in_relative_range(contacts)
        if not inside.any():
            continue
        chosen = contacts.select(inside)
        before, after = (
            force_residual(force_n[inside], chosen).mean_error_percent
            for force_n in (contacts.law_n, held_out_n)
        )
        errors.append(BinErrors(low_kpa, high_kpa, len(chosen), before, after))
    return errors


def share_and_floor(held_out_n: Numbers, contacts: CalibrationContacts) -> tuple[float, float]:
    """Return the standard deviation of the error in two parts: a share of the force, and a floor [N].

    Both parts are maximum likelihood estimates from the errors on held-out contacts.
    """
    from scipy.optimize import minimize

    squares = (held_out_n - contacts.force_n) ** 2
    forces = contacts.force_n

    def negative_log_likelihood(logs: Numbers) -> float:
        share, floor_n = np.exp(logs)
        variances = (share * forces) ** 2 + floor_n**2
        return float((np.log(variances) + squares / variances).sum())

    rms_n = math.sqrt(squares.mean())
    start = np.log([rms_n / forces.mean(), rms_n / 2])
    bounds = [(math.log(1e-4), 0.0), (math.log(1e-4), math.log(5.0))]
    solution = minimize(negative_log_likelihood, start, bounds=bounds)
    share, floor_n = np.exp(solution.x).tolist()
    return share, floor_n


def _mean(values: Numbers) -> float:
    return float(values.mean()) if len(values) else math.nan
