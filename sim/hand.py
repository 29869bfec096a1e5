"""The simulated hand: strokes of force, from a table or by command."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import cycle
from typing import NamedTuple

#: The hand waits until the balloon has been held for this long.
READY_S = 1.0
STEEPEST_N_PER_S = 10.0


class Press(NamedTuple):
    """One contact. Release takes as long as the rise."""

    force_n: float
    rise_s: float
    hold_s: float
    pause_s: float


PRESSES = (
    Press(1.5, 0.40, 1.8, 1.5),  # plateaus
    Press(2.2, 0.50, 2.0, 1.2),
    Press(1.0, 0.25, 0.05, 0.8),  # taps
    Press(1.6, 0.30, 0.05, 0.8),
    Press(3.0, 0.80, 1.5, 1.5),
    Press(2.0, 2.50, 0.3, 1.2),  # a slow press
    Press(1.8, 0.30, 0.10, 0.04),  # fast contacts, the next before the pressure has recovered
    Press(2.2, 0.36, 0.10, 0.04),
    Press(1.5, 0.30, 0.10, 1.5),
    Press(0.8, 0.30, 1.6, 1.2),
)


class Stroke(NamedTuple):
    """The force on its way from one value to another; slope and force are smooth."""

    from_n: float
    to_n: float
    lasts_s: float

    def at(self, t_s: float) -> float:
        """Force [N] at a time since its start: half a cosine."""
        if t_s >= self.lasts_s:
            return self.to_n
        return self.from_n + (self.to_n - self.from_n) * 0.5 * (1 - math.cos(math.pi * t_s / self.lasts_s))


def stroke(from_n: float, to_n: float) -> Stroke:
    """The fastest stroke that stays within 10 N/s."""
    return Stroke(from_n, to_n, max(0.02, math.pi / 2 * abs(to_n - from_n) / STEEPEST_N_PER_S))


def strokes(presses: tuple[Press, ...] = PRESSES) -> Iterator[Stroke]:
    """The table as strokes, for ever."""
    for press in cycle(presses):
        yield Stroke(0.0, press.force_n, press.rise_s)
        yield Stroke(press.force_n, press.force_n, press.hold_s)
        yield Stroke(press.force_n, 0.0, press.rise_s)
        yield Stroke(0.0, 0.0, press.pause_s)


class Hand:
    """Presses the balloon again and again while it is held, unless told otherwise."""

    def __init__(self, works: bool) -> None:
        self.works = works  #: whether it goes through its table
        self.force_n = 0.0
        self._table = strokes()
        self._stroke = Stroke(0.0, 0.0, 0.0)
        self._since_s = 0.0
        self._commanded = False  # a press by command overrides the table
        self._held_s = 0.0

    def press(self, force_n: float) -> None:
        """Press with `force_n` and stay there until released."""
        self._commanded = True
        self._begin(stroke(self.force_n, force_n))

    def release(self) -> None:
        """Let go, and then go on with the table if the hand works."""
        self._commanded = False
        self._let_go()

    def step(self, held: bool, dt_s: float) -> float:
        """Force [N], `dt_s` later; `held` says whether the board holds the balloon now."""
        self._held_s = self._held_s + dt_s if held else 0.0
        self._since_s += dt_s
        if not self._commanded:
            self._follow_table()
        self.force_n = self._stroke.at(self._since_s)
        return self.force_n

    def _follow_table(self) -> None:
        if not (self.works and self._held_s > READY_S):
            if self._stroke.to_n > 0:
                self._let_go()
        elif self._since_s >= self._stroke.lasts_s:
            self._begin(next(self._table))

    def _let_go(self) -> None:
        self._begin(stroke(self.force_n, 0.0))
        self._table = strokes()

    def _begin(self, stroke: Stroke) -> None:
        self._stroke, self._since_s = stroke, 0.0
