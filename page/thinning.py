"""Samples for a plot: so many less that a browser can keep up, and no extreme lost."""

from __future__ import annotations

import math
from typing import NamedTuple

from instrument.tape.measured import Measured

BUCKET_S = 0.04
MOST_SHOWN = 4  #: of a bucket
MOST_OF_BUCKET = 256  #: a clock that stands still must not fill the memory


class Point(NamedTuple):
    """One sample of the plots; NaN where a quantity is not available."""

    t_s: float
    force_n: float
    std_n: float
    pressure_kpa: float
    initial_kpa: float
    in_contact: bool


_PLOTTED = (Point._fields.index("force_n"), Point._fields.index("pressure_kpa"))


def point_of(m: Measured) -> Point:
    """What the plots show of a sample."""
    return Point(m.t_s, m.force_n, m.force_std_n, m.pressure_kpa, m.initial_kpa, m.in_contact)


class Thinning:
    """Points in, and of each bucket of time out: its least and greatest force and pressure.

    That is at most 100 points a second at whatever rate they come.
    """

    def __init__(self) -> None:
        self._bucket: list[Point] = []
        self._key = 0

    def take(self, point: Point) -> list[Point]:
        """The points to be shown of the bucket that ends with this one; mostly none."""
        key = math.floor(point.t_s / BUCKET_S) if math.isfinite(point.t_s) else self._key
        shown = []
        if key != self._key or len(self._bucket) >= MOST_OF_BUCKET:
            shown, self._bucket, self._key = extremes(self._bucket), [], key
        self._bucket.append(point)
        return shown


def extremes(points: list[Point]) -> list[Point]:
    """The points with the least and the greatest force and pressure, in order; the first, if all are NaN."""
    if len(points) <= MOST_SHOWN:
        return points
    kept: set[int] = set()
    for at in _PLOTTED:
        values = [point[at] for point in points]
        known = [i for i, value in enumerate(values) if math.isfinite(value)]
        if known:
            kept |= {min(known, key=values.__getitem__), max(known, key=values.__getitem__)}
    return [points[i] for i in sorted(kept)] or points[:1]
