"""Decimation of live samples for the plots of the browsers.

The buckets have a fixed duration, because points that a browser has received cannot be changed.
`instrument/recording/decimation.py` decimates a complete recording into a fixed number of buckets instead.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from pneuforce.instrument.stream.sample_record import SampleRecord

BUCKET_S = 0.04
MAX_BUCKET_POINTS = 4  #: minimum and maximum of force and pressure
MAX_BUCKET_SAMPLES = 256  #: limits the memory if the times of the samples do not increase


class LivePoint(NamedTuple):
    """One sample as the plots show it. A quantity that is not available is NaN."""

    t_s: float
    force_n: float
    std_n: float
    lower_limit_n: float  #: a smaller force of a contact shows only that something touches the balloon
    pressure_kpa: float
    baseline_kpa: float
    in_contact: bool
    state: int  #: code of the board's state, see STATES in registers/codes.py


_FORCE = LivePoint._fields.index("force_n")
_PRESSURE = LivePoint._fields.index("pressure_kpa")


def live_point(m: SampleRecord) -> LivePoint:
    """Return the quantities of a sample that the plots show."""
    return LivePoint(
        t_s=m.t_s,
        force_n=m.force_n,
        std_n=m.force_std_n,
        lower_limit_n=m.force_lower_range_limit_n,
        pressure_kpa=m.pressure_kpa,
        baseline_kpa=m.baseline_kpa,
        in_contact=m.in_contact,
        state=m.state,
    )


class LiveDecimator:
    """Min/max decimator with buckets of `BUCKET_S`.

    The output has at most 100 points per second at any sample rate. Each bucket keeps the points with the
    minimum and the maximum of force and pressure.
    """

    def __init__(self) -> None:
        self._bucket: list[LivePoint] = []
        self._bucket_number = 0

    def add(self, point: LivePoint) -> list[LivePoint]:
        """Add a point. Return the points of the bucket that this point completes, usually []."""
        number = math.floor(point.t_s / BUCKET_S) if math.isfinite(point.t_s) else self._bucket_number
        finished: list[LivePoint] = []
        if number != self._bucket_number or len(self._bucket) >= MAX_BUCKET_SAMPLES:
            finished, self._bucket, self._bucket_number = extremes(self._bucket), [], number
        self._bucket.append(point)
        return finished


def extremes(points: list[LivePoint]) -> list[LivePoint]:
    """Return the points with the minimum and maximum of force and pressure, in order of time.

    Return all points if there are at most four. Return the first point if all forces and pressures are NaN.
    """
    if len(points) <= MAX_BUCKET_POINTS:
        return points
    selected: set[int] = set()
    for field in (_FORCE, _PRESSURE):
        values = [point[field] for point in points]
        valid = [i for i, value in enumerate(values) if math.isfinite(value)]
        if valid:
            selected |= {min(valid, key=values.__getitem__), max(valid, key=values.__getitem__)}
    return [points[i] for i in sorted(selected)] or points[:1]
