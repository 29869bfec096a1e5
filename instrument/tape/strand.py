"""A curve of any length in few points, which keeps its extremes: no peak is lost however long it is.

Its buckets are of so many points, and grow with the curve: how long it gets is known at its end. The page
cannot take back what it has shown, so it thins by buckets of time (`page/thinning.py`).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

BUCKETS = 600  #: at least so many, once there are as many points; fewer than twice as many


class Point(NamedTuple):
    """One point of a curve, and how uncertain it is."""

    t_s: float
    value: float
    std: float = 0.0


class _Bucket(NamedTuple):
    """The extremes of some points that follow each other; `low` is NaN where there was no value."""

    low: Point
    high: Point


class Strand:
    """Takes points in order. Where the value is NaN the curve is interrupted."""

    def __init__(self, buckets: int = BUCKETS) -> None:
        self._most = 2 * buckets
        self._buckets: list[_Bucket] = []
        self._low = self._high = Point(math.nan, math.nan)
        self._in_bucket = 0
        self.each = 1  #: points in a bucket

    def take(self, t_s: float, value: float, std: float = 0.0) -> None:
        """Use one point; each costs the same, but for an occasional halving of what is kept."""
        if self._low.value != self._low.value:
            self._low = self._high = Point(t_s, value, std)
        elif value < self._low.value:
            self._low = Point(t_s, value, std)
        elif value > self._high.value:
            self._high = Point(t_s, value, std)
        self._in_bucket += 1
        if self._in_bucket >= self.each:
            self._close()

    def _close(self) -> None:
        if self._in_bucket:
            self._buckets.append(_Bucket(self._low, self._high))
            self._low = self._high = Point(math.nan, math.nan)
            self._in_bucket = 0
        if len(self._buckets) >= self._most:
            self._halve()

    def _halve(self) -> None:
        kept = self._buckets
        self._buckets = [_joined(*kept[n : n + 2]) for n in range(0, len(kept), 2)]
        self.each *= 2

    @property
    def thinned(self) -> bool:
        """Whether points were left out."""
        return self.each > 1

    def points(self) -> NDArray[np.float64]:
        """What is kept, in order of time: rows of time, value and uncertainty."""
        kept = [*self._buckets, _Bucket(self._low, self._high)] if self._in_bucket else self._buckets
        rows = [point for low, high in kept for point in _in_order(low, high)]
        return np.array(rows, float).reshape(-1, 3)


def _in_order(low: Point, high: Point) -> tuple[Point, ...]:
    if low.t_s == high.t_s:
        return (low,)
    return (low, high) if low.t_s < high.t_s else (high, low)


def _joined(first: _Bucket, second: _Bucket | None = None) -> _Bucket:
    if second is None or math.isnan(second.low.value):
        return first
    low = first.low if first.low.value <= second.low.value else second.low
    return _Bucket(low, first.high if first.high.value >= second.high.value else second.high)
