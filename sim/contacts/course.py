"""Courses: a force [N] or a travel [mm] as a function of the time since its begin."""

from __future__ import annotations

import math
from bisect import bisect_left
from itertools import accumulate
from typing import NamedTuple, Protocol

#: What a hand does unless it is asked for more [N/s or mm/s].
STEEPEST_PER_S = 10.0
BRIEFEST_S = 0.02
#: An oscillation swells and fades within this time, or half of it begins and ends with a jolt.
SWELL_S = 0.25


class Piece(Protocol):
    """A part of a course."""

    @property
    def lasts_s(self) -> float:
        """How long it lasts [s]."""
        ...

    def at(self, t_s: float) -> float:
        """Force [N] or travel [mm] at a time from 0 to `lasts_s` after its begin."""
        ...


class Stroke(NamedTuple):
    """From one value to another by half a cosine: value and slope are smooth."""

    start: float
    end: float
    lasts_s: float

    def at(self, t_s: float) -> float:
        """The value at a time since its begin."""
        return self.start + (self.end - self.start) * 0.5 * (1 - math.cos(math.pi * t_s / self.lasts_s))


class Straight(NamedTuple):
    """From one value to another at a constant rate."""

    start: float
    end: float
    lasts_s: float

    def at(self, t_s: float) -> float:
        """The value at a time since its begin."""
        return self.start + (self.end - self.start) * t_s / self.lasts_s


class Wave(NamedTuple):
    """A sine around a mean, whose frequency goes evenly from one to another; it swells and fades."""

    mean: float
    amplitude: float
    from_hz: float
    to_hz: float
    lasts_s: float

    def at(self, t_s: float) -> float:
        """The value at a time since its begin."""
        turns = t_s * (self.from_hz + (self.to_hz - self.from_hz) * t_s / (2 * self.lasts_s))
        swell = min(t_s / SWELL_S, (self.lasts_s - t_s) / SWELL_S, 1.0)
        return self.mean + self.amplitude * swell * math.sin(2 * math.pi * turns)


class Recorded(NamedTuple):
    """Points in time, joined by straight lines. The first is at 0 s, and there are at least two."""

    times_s: tuple[float, ...]
    values: tuple[float, ...]

    @property
    def lasts_s(self) -> float:
        """How long it lasts [s]."""
        return self.times_s[-1]

    def at(self, t_s: float) -> float:
        """The value at a time since its begin."""
        right = max(1, bisect_left(self.times_s, t_s))
        t0, t1 = self.times_s[right - 1], self.times_s[right]
        v0, v1 = self.values[right - 1], self.values[right]
        return v0 + (v1 - v0) * (t_s - t0) / (t1 - t0)


class Course(NamedTuple):
    """Pieces one after another; after the last its end stays."""

    pieces: tuple[Piece, ...]
    ends_s: tuple[float, ...]

    @classmethod
    def of(cls, *pieces: Piece) -> Course:
        """A course of those of these pieces that last; one must."""
        lasting = tuple(piece for piece in pieces if piece.lasts_s > 0)
        return cls(lasting, tuple(accumulate(piece.lasts_s for piece in lasting)))

    @property
    def lasts_s(self) -> float:
        """How long it lasts [s]."""
        return self.ends_s[-1]

    def at(self, t_s: float) -> float:
        """Force [N] or travel [mm] at a time since its begin."""
        index = bisect_left(self.ends_s, t_s)
        if index == len(self.pieces):
            return self.pieces[-1].at(self.pieces[-1].lasts_s)
        return self.pieces[index].at(t_s - (self.ends_s[index - 1] if index else 0.0))


def stay(value: float, lasts_s: float) -> Straight:
    """No change for a time."""
    return Straight(value, value, lasts_s)


def stroke(start: float, end: float, lasts_s: float | None = None) -> Stroke:
    """A stroke that takes `lasts_s`, or as long as 10 N/s (10 mm/s) at its steepest ask."""
    gentle_s = max(BRIEFEST_S, math.pi / 2 * abs(end - start) / STEEPEST_PER_S)
    return Stroke(start, end, gentle_s if lasts_s is None else lasts_s)
