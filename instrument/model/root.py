"""A safeguarded Newton root, for floats and for arrays without a Python loop over samples."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from instrument.model.balloon import Number

TOLERANCE_MM = 1e-10
MOST_STEPS = 60

Balance = Callable[[Number], tuple[Number, Number]]


def root_above(balance: Balance, low: Number, high: Number, start: Number) -> Number:
    """The root of `balance` (value and slope at x) in [low, high], negative below it and positive above.

    Newton's step is taken where it stays within the bracket, else the bracket is halved. NaN where the
    bracket is empty or the balance is not negative at `low`: there is no physical root.
    """
    if isinstance(low, float):
        return _root_of_floats(balance, low, float(high), float(start))
    return _root_of_arrays(balance, low, high, start)


def _root_of_floats(balance: Balance, low: float, high: float, x: float) -> float:
    if not low < high or not balance(low)[0] < 0:
        return math.nan
    for _ in range(MOST_STEPS):
        value, slope = balance(x)
        if value > 0:
            high = x
        else:
            low = x
        following = x - value / slope if slope else math.nan
        if not low <= following <= high:
            following = 0.5 * (low + high)
        if abs(following - x) < TOLERANCE_MM:
            return following
        x = following
    return x


def _root_of_arrays(balance: Balance, low: Any, high: Any, x: Any) -> Any:
    import numpy as np

    with np.errstate(all="ignore"):
        possible = (low < high) & (balance(low)[0] < 0)
        for _ in range(MOST_STEPS):
            value, slope = balance(x)
            above = value > 0
            low, high = np.where(above, low, x), np.where(above, x, high)
            following = x - value / slope
            inside = (low <= following) & (following <= high)
            following = np.where(inside, following, 0.5 * (low + high))
            moved = np.abs(following - x)
            x = following
            if not np.any(moved[possible] >= TOLERANCE_MM):
                break
        return np.where(possible, x, np.nan)
