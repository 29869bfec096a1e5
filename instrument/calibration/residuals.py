"""What a calibration leaves over, on contacts that it has not seen: the figures that a user asks for."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from instrument.calibration.contacts import TURN_N, Contacts
from instrument.columns import Numbers
from instrument.fifths import EDGES_KPA, fifths_of

MOST_N = 3.5  #: the paper's highest force


class Residual(NamedTuple):
    """How well forces agree with those of the cell; NaN where there are no such contacts."""

    rmse_n: float  #: of forces below 1 N
    mean_error_percent: float  #: of forces from 1 to 3.5 N


class Bin(NamedTuple):
    """The contacts from 1 to 3.5 N in a fifth of the pressures."""

    low_kpa: float
    high_kpa: float
    contacts: int
    before_percent: float  #: mean error of the bare law
    after_percent: float  #: of the calibration, contact by contact left out


def residual_of(force_n: Numbers, contacts: Contacts) -> Residual:
    """What some forces are off by."""
    truth = contacts.force_n
    error = force_n - truth
    rmse_n = math.sqrt(_mean(error[truth < TURN_N] ** 2))
    return Residual(rmse_n, 100 * _mean(np.abs(error / truth)[large(contacts)]))


def large(contacts: Contacts) -> NDArray[np.bool_]:
    """Which contacts are of 1 to 3.5 N, where errors are told as a share."""
    return (contacts.force_n >= TURN_N) & (contacts.force_n <= MOST_N)


def bins(unseen_n: Numbers, contacts: Contacts) -> list[Bin]:
    """Mean errors before and after, in those fifths of the validated pressures that have contacts."""
    fifths, found = fifths_of(contacts.initial_kpa), []
    for n, (low, high) in enumerate(pairwise(EDGES_KPA)):
        inside = (fifths == n) & large(contacts)
        if not inside.any():
            continue
        part = contacts.only(inside)
        before, after = (residual_of(force_n[inside], part) for force_n in (contacts.law_n, unseen_n))
        found.append(Bin(low, high, len(part), before.mean_error_percent, after.mean_error_percent))
    return found


def share_and_floor(unseen_n: Numbers, contacts: Contacts) -> tuple[float, float]:
    """The most likely errors of a calibrated force: a share of it, and newtons, as standard deviations."""
    from scipy.optimize import minimize

    squares = (unseen_n - contacts.force_n) ** 2
    forces = contacts.force_n

    def unlikely(logs: Numbers) -> float:
        share, floor_n = np.exp(logs)
        variances = (share * forces) ** 2 + floor_n**2
        return float((np.log(variances) + squares / variances).sum())

    typical = math.sqrt(squares.mean())
    start = np.log([typical / forces.mean(), typical / 2])
    found = minimize(unlikely, start, bounds=[(math.log(1e-4), 0.0), (math.log(1e-4), math.log(5.0))])
    share, floor_n = np.exp(found.x).tolist()
    return share, floor_n


def _mean(values: Numbers) -> float:
    return float(values.mean()) if len(values) else math.nan
