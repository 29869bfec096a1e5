"""Trajectories: a force [N] or a travel [mm] as a function of the time since the start of the contact."""

from __future__ import annotations

import math
from bisect import bisect_left
from itertools import accumulate
from typing import NamedTuple, Protocol

#: Highest rate of a hand [N/s or mm/s], unless the scenario requires a shorter rise time.
MAX_RATE_PER_S = 10.0
MIN_CHANGE_S = 0.02
#: Time in which the amplitude of an oscillation rises at its start and falls at its end [s]. An abrupt start
#: or end would be a jolt.
SWELL_S = 0.25


class Segment(Protocol):
    """Part of a trajectory."""

    @property
    def duration_s(self) -> float:
        """Return the duration [s]."""
        ...

    def at(self, t_s: float) -> float:
        """Return the force [N] or travel [mm] at a time from 0 to `duration_s` after the segment's start."""
        ...


class SmoothChange(NamedTuple):
    """Half cosine from one value to another: value and slope are continuous."""

    start: float
    end: float
    duration_s: float

    def at(self, t_s: float) -> float:
        """Return the value at a time since the start of the segment."""
        return self.start + (self.end - self.start) * 0.5 * (1 - math.cos(math.pi * t_s / self.duration_s))


class LinearChange(NamedTuple):
    """Change from one value to another at a constant rate."""

    start: float
    end: float
    duration_s: float

    def at(self, t_s: float) -> float:
        """Return the value at a time since the start of the segment."""
        return self.start + (self.end - self.start) * t_s / self.duration_s


class Oscillation(NamedTuple):
    """Sine around a mean. Its amplitude rises at the start and falls at the end.

    The frequency changes linearly from start to end.
    """

    mean: float
    amplitude: float
    from_hz: float
    to_hz: float
    duration_s: float

    def at(self, t_s: float) -> float:
        """Return the value at a time since the start of the segment."""
        periods = t_s * (self.from_hz + (self.to_hz - self.from_hz) * t_s / (2 * self.duration_s))
        swell = min(t_s / SWELL_S, (self.duration_s - t_s) / SWELL_S, 1.0)
        return self.mean + self.amplitude * swell * math.sin(2 * math.pi * periods)


class Polyline(NamedTuple):
    """Values at increasing times, with linear interpolation.

    At least two points are required. The first time is 0 s.
    """

    times_s: tuple[float, ...]
    values: tuple[float, ...]

    @property
    def duration_s(self) -> float:
        """Return the duration [s]."""
        return self.times_s[-1]

    def at(self, t_s: float) -> float:
        """Return the value at a time since the start of the segment."""
        right = max(1, bisect_left(self.times_s, t_s))
        t0, t1 = self.times_s[right - 1], self.times_s[right]
        v0, v1 = self.values[right - 1], self.values[right]
        return v0 + (v1 - v0) * (t_s - t0) / (t1 - t0)


class Trajectory(NamedTuple):
    """Sequence of segments. After the last segment, the value remains constant."""

    segments: tuple[Segment, ...]
    ends_s: tuple[float, ...]

    @classmethod
    def of(cls, *segments: Segment) -> Trajectory:
        """Return the sequence of all segments with a duration above 0 s.

        At least one such segment is required.
        """
        lasting = tuple(segment for segment in segments if segment.duration_s > 0)
        return cls(lasting, tuple(accumulate(segment.duration_s for segment in lasting)))

    @property
    def duration_s(self) -> float:
        """Return the duration [s]."""
        return self.ends_s[-1]

    def at(self, t_s: float) -> float:
        """Return the force [N] or travel [mm] at a time since the start of the trajectory."""
        index = bisect_left(self.ends_s, t_s)
        if index == len(self.segments):
            return self.segments[-1].at(self.segments[-1].duration_s)
        return self.segments[index].at(t_s - (self.ends_s[index - 1] if index else 0.0))


def constant(value: float, duration_s: float) -> LinearChange:
    """Return a segment with a constant value."""
    return LinearChange(value, value, duration_s)


def smooth_change(start: float, end: float, duration_s: float | None = None) -> SmoothChange:
    """Return a half cosine of `duration_s`. By default, its steepest slope is 10 N/s or 10 mm/s."""
    default_s = max(MIN_CHANGE_S, math.pi / 2 * abs(end - start) / MAX_RATE_PER_S)
    return SmoothChange(start, end, default_s if duration_s is None else duration_s)
