"""Root finding by a safeguarded Newton method, for floats and for arrays."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from pneuforce.instrument.model.balloon import Number

TOLERANCE_MM = 1e-10
MAX_ITERATIONS = 60

Balance = Callable[[Number], tuple[Number, Number]]


def find_root(balance: Balance, low: Number, high: Number, start: Number) -> Number:
    """Return the root of `balance` between `low` and `high`, NaN if there is no root.

    `balance` returns its value and slope at x. The value is negative below the root and positive above. A
    Newton step that leaves the bracket is replaced by a bisection. There is no root if the bracket is empty
    or if the value at `low` is not negative.
    """
    if isinstance(low, float):
        return _find_float_root(balance, low, float(high), float(start))
    return _find_array_root(balance, low, high, start)


def _find_float_root(balance: Balance, low: float, high: float, x: float) -> float:
    if not low < high or not balance(low)[0] < 0:
        return math.nan
    for _ in range(MAX_ITERATIONS):
        value, slope = balance(x)
        if value > 0:
            high = x
        else:
            low = x
        next_x = x - value / slope if slope else math.nan
        if not low <= next_x <= high:
            next_x = 0.5 * (low + high)
        if abs(next_x - x) < TOLERANCE_MM:
            return next_x
        x = next_x
    return x


def _find_array_root(balance: Balance, low: Any, high: Any, x: Any) -> Any:
    import numpy as np

    with np.errstate(all="ignore"):
        has_root = (low < high) & (balance(low)[0] < 0)
        for _ in range(MAX_ITERATIONS):
            value, slope = balance(x)
            above = value > 0
            low, high = np.where(above, low, x), np.where(above, x, high)
            next_x = x - value / slope
            inside = (low <= next_x) & (next_x <= high)
            next_x = np.where(inside, next_x, 0.5 * (low + high))
            step = np.abs(next_x - x)
            x = next_x
            if not np.any(step[has_root] >= TOLERANCE_MM):
                break
        return np.where(has_root, x, np.nan)
