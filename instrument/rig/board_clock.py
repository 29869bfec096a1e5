"""The board's clock on the host's: when a sample was taken, though it may have been read much later."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

WRAP_US = 2**32
#: Of what is received only the earliest in each block counts: nothing arrives before it was sent.
BLOCK_S = 0.25
KEPT_S = 8.0
RATE_FROM_S = 2.0  #: within less time a late delivery looks like a slow clock
MOST_RATE_ERROR = 0.02
#: An UNO's ceramic resonator is within 0.5 %; one that is off by more than 1 % is another, or broken.
RESONATOR_ERROR, OFF_ERROR = 0.005, 0.01
OFF_FROM_S = 4.0  #: within less time a late delivery looks like a clock that is off
SAME_S = 1e-6  #: earlier by less is rounding, and no reason to fit the line anew
#: A reading so far ahead of the clock is no early one: the board has restarted, or the host has slept.
JUMP_S = 0.25
#: Where a whole block is late by so much, and was not read at once, the board's clock has stood for a while.
SLIP_S = 0.05


class _Arrival(NamedTuple):
    board_s: float
    offset_s: float  # when it came, minus `board_s`


class BoardClock:
    """Follows a board's clock from its readings and the times at which they came.

    The least delays lie on a line whose slope is the clock's error (S. Zhang, Z. Liu, H. Xia, Clock
    synchronization algorithms for network measurements, 2002: the edge of the lower convex hull below the
    centroid). The least delay itself, some ms, cannot be seen: a time told here is late by it.
    """

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Another board, or the same after a restart. Times already told are not gone back behind."""
        self._last_us: int | None = None
        self._board_s = self._block_s = self._block_received_s = 0.0
        self._arrivals: list[_Arrival] = []
        self._slope = self._offset_s = 0.0
        self.off = False  #: it is wrong by more than any resonator is, by a look of 4 s

    _told_s = -math.inf

    @property
    def rate_error(self) -> float:
        """By which share the board's clock is too fast, within ±0.02; NaN in the first two seconds."""
        return 1 / (1 + self._slope) - 1 if self._span_s >= RATE_FROM_S else math.nan

    def taken_s(self, board_time_us: int, received_s: float, latest_s: float = math.inf) -> float:
        """Host time [s] of a board time [µs, wrapping]: never after its reception, never going back.

        `latest_s` is when it was at the latest, by other evidence.
        """
        self._advance(board_time_us)
        if self._line_s - received_s > JUMP_S:
            self.restart()
            self._advance(board_time_us)
        self._note(received_s)
        self._told_s = max(self._told_s, min(self._line_s, received_s, latest_s))
        return self._told_s

    def _advance(self, board_time_us: int) -> None:
        if self._last_us is not None:
            passed_us = (board_time_us - self._last_us) % WRAP_US
            if passed_us >= WRAP_US // 2:
                self.restart()
            else:
                self._board_s += passed_us * 1e-6
        self._last_us = board_time_us

    @property
    def _line_s(self) -> float:
        """When the present board time was, by what came before."""
        if not self._arrivals:
            return -math.inf
        return self._board_s * (1 + self._slope) + self._offset_s

    def _note(self, received_s: float) -> None:
        arrival = _Arrival(self._board_s, received_s - self._board_s)
        early = received_s < self._line_s - SAME_S
        if not self._arrivals or arrival.board_s >= self._block_s + BLOCK_S:
            self._begin_block(arrival, received_s)
        elif early or arrival.offset_s < self._arrivals[-1].offset_s:
            self._arrivals[-1] = arrival
            if early:
                self._fit()

    def _begin_block(self, arrival: _Arrival, received_s: float) -> None:
        if self._slipped(received_s):
            del self._arrivals[:-1]
        self._block_s, self._block_received_s = arrival.board_s, received_s
        oldest_s = arrival.board_s - KEPT_S
        self._arrivals = [kept for kept in self._arrivals if kept.board_s >= oldest_s]
        self._arrivals.append(arrival)
        self._fit()

    def _slipped(self, received_s: float) -> bool:
        """Whether the block that ends now came in its own time, but all of it late."""
        if not self._arrivals or received_s - self._block_received_s < BLOCK_S / 2:
            return False
        board_s, offset_s = self._arrivals[-1]
        return offset_s - (self._slope * board_s + self._offset_s) > SLIP_S

    @property
    def _span_s(self) -> float:
        return self._arrivals[-1].board_s - self._arrivals[0].board_s if self._arrivals else 0.0

    def _fit(self) -> None:
        """The line below all arrivals, along the edge of their hull below the centroid."""
        arrivals = self._arrivals
        slope = _slope_at_centroid(arrivals) if self._span_s >= RATE_FROM_S else 0.0
        self._slope = min(max(slope, -MOST_RATE_ERROR), MOST_RATE_ERROR)
        self._offset_s = min(offset_s - self._slope * board_s for board_s, offset_s in arrivals)
        self.off = self._span_s >= OFF_FROM_S and abs(self.rate_error) > OFF_ERROR


def _slope_at_centroid(arrivals: list[_Arrival]) -> float:
    """Slope of the lower convex hull (Andrew's monotone chain) at the mean board time."""
    hull: list[_Arrival] = []
    for arrival in arrivals:
        while len(hull) > 1 and _slope(hull[-2], hull[-1]) >= _slope(hull[-2], arrival):
            hull.pop()
        hull.append(arrival)
    centre_s = math.fsum(board_s for board_s, _ in arrivals) / len(arrivals)
    return next(_slope(a, b) for a, b in pairwise(hull) if b.board_s >= centre_s)


def _slope(a: _Arrival, b: _Arrival) -> float:
    return (b.offset_s - a.offset_s) / (b.board_s - a.board_s)
