"""Min/max decimation: reduction of a long curve to few points that include every peak.

All buckets contain the same number of points. This number doubles as the curve grows, because the length of a
recording is known only at its end. The web page cannot change points that it has shown, so it uses buckets of
equal time (`web/decimation.py`).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

MIN_BUCKETS = 600  #: a long curve has at least this number of buckets and less than twice this number


class CurvePoint(NamedTuple):
    """One point of a curve with its standard uncertainty."""

    t_s: float
    value: float
    std: float = 0.0


class _Bucket(NamedTuple):
    """Extremes of consecutive points. `low.value` is NaN if all values were NaN."""

    low: CurvePoint
    high: CurvePoint


class MinMaxDecimator:
    """Decimator that keeps the minimum and the maximum of each bucket. A NaN value interrupts the curve."""

    def __init__(self, min_buckets: int = MIN_BUCKETS) -> None:
        self._max_buckets = 2 * min_buckets
        self._buckets: list[_Bucket] = []
        self._low = self._high = CurvePoint(math.nan, math.nan)
        self._in_bucket = 0
        self.points_per_bucket = 1

    def add(self, t_s: float, value: float, std: float = 0.0) -> None:
        """Add a point. The processing time is constant, except when the buckets are merged in pairs."""
        if math.isnan(self._low.value):
            self._low = self._high = CurvePoint(t_s, value, std)
        elif value < self._low.value:
            self._low = CurvePoint(t_s, value, std)
        elif value > self._high.value:
            self._high = CurvePoint(t_s, value, std)
        self._in_bucket += 1
        if self._in_bucket >= self.points_per_bucket:
            self._close_bucket()

    def _close_bucket(self) -> None:
        if self._in_bucket:
            self._buckets.append(_Bucket(self._low, self._high))
            self._low = self._high = CurvePoint(math.nan, math.nan)
            self._in_bucket = 0
        if len(self._buckets) >= self._max_buckets:
            self._merge_pairs()

    def _merge_pairs(self) -> None:
        buckets = self._buckets
        self._buckets = [_merged(*buckets[n : n + 2]) for n in range(0, len(buckets), 2)]
        self.points_per_bucket *= 2

    @property
    def decimated(self) -> bool:
        """Return True if a bucket contains several points, of which only two are kept."""
        return self.points_per_bucket > 1

    def points(self) -> NDArray[np.float64]:
        """Return the kept points in order of time, shape (n, 3): time, value and uncertainty."""
        buckets = [*self._buckets, _Bucket(self._low, self._high)] if self._in_bucket else self._buckets
        rows = [point for low, high in buckets for point in _in_order(low, high)]
        return np.array(rows, float).reshape(-1, 3)


def _in_order(low: CurvePoint, high: CurvePoint) -> tuple[CurvePoint, ...]:
    if low.t_s == high.t_s:
        return (low,)
    return (low, high) if low.t_s < high.t_s else (high, low)


def _merged(first: _Bucket, second: _Bucket | None = None) -> _Bucket:
    if second is None or math.isnan(second.low.value):
        return first
    low = first.low if first.low.value <= second.low.value else second.low
    return _Bucket(low, first.high if first.high.value >= second.high.value else second.high)
