"""Estimate of the host time at which the board took a sample, from board times and reception times."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple

WRAP_US = 2**32
#: Length of a block [s]. Only the reception with the smallest delay in each block is used.
BLOCK_S = 0.25
WINDOW_S = 8.0  #: older blocks are discarded
MIN_RATE_SPAN_S = 2.0  #: over a shorter span, a late delivery looks like a rate error
MAX_RATE_ERROR = 0.02
#: The error of the ceramic resonator of an UNO is below 0.5 %. An error above 1 % means a wrong or defective
#: resonator.
RESONATOR_TOLERANCE, CLOCK_FAULT_ERROR = 0.005, 0.01
MIN_FAULT_SPAN_S = 4.0  #: over a shorter span, a late delivery looks like a clock fault
ROUNDING_S = 1e-6  #: a smaller difference from the line is a rounding error and needs no new fit
#: If the fitted line gives a host time that is later than the reception by more than this time, the board has
#: restarted or the host was suspended.
JUMP_S = 0.25
#: If a block is received at normal speed, but later than the line by more than this time, the board's clock
#: had stopped.
SLIP_S = 0.05


class _Arrival(NamedTuple):
    board_s: float
    offset_s: float  # reception time minus `board_s`


@dataclass(slots=True)
class BoardClock:
    """Mapping of the board's clock to the host's clock.

    The smallest delays lie on a line whose slope is the rate error of the board's clock. The line is the edge
    of the lower convex hull of the receptions, below their centroid (S. Zhang, Z. Liu, H. Xia, Clock
    synchronization algorithms for network measurements, 2002). The smallest delay itself, some ms, cannot be
    measured. All returned host times are late by this delay.
    """

    out_of_tolerance: bool = False  #: the rate error is above 1 %, measured over at least 4 s
    _last_us: int | None = None
    _board_s: float = 0.0
    _block_s: float = 0.0
    _block_received_s: float = 0.0
    _arrivals: list[_Arrival] = field(default_factory=list)
    _slope: float = 0.0
    _offset_s: float = 0.0
    _latest_result_s: float = -math.inf

    def restart(self) -> None:
        """Discard the fit, because the board was replaced or has restarted.

        The latest returned host time is kept, so that returned host times never decrease.
        """
        self._last_us = None
        self._board_s = self._block_s = self._block_received_s = 0.0
        self._arrivals = []
        self._slope = self._offset_s = 0.0
        self.out_of_tolerance = False

    @property
    def rate_error(self) -> float:
        """Return the relative rate error, positive for a fast board clock, within ±0.02.

        The result is NaN in the first two seconds.
        """
        return 1 / (1 + self._slope) - 1 if self._span_s >= MIN_RATE_SPAN_S else math.nan

    def host_time_s(self, board_time_us: int, received_s: float, latest_s: float = math.inf) -> float:
        """Return the host time [s] that corresponds to a board time [µs, wraps at 2³²].

        The result never decreases, and is never later than `received_s` or `latest_s`, except to prevent a
        decrease. `latest_s` is an upper limit from another source.
        """
        self._advance(board_time_us)
        if self._line_s - received_s > JUMP_S:
            self.restart()
            self._advance(board_time_us)
        self._add(received_s)
        self._latest_result_s = max(self._latest_result_s, min(self._line_s, received_s, latest_s))
        return self._latest_result_s

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
        """Return the host time that the fitted line gives for the present board time [s]."""
        if not self._arrivals:
            return -math.inf
        return self._board_s * (1 + self._slope) + self._offset_s

    def _add(self, received_s: float) -> None:
        """Add one reception to the blocks and fit the line again if necessary."""
        arrival = _Arrival(self._board_s, received_s - self._board_s)
        early = received_s < self._line_s - ROUNDING_S
        if not self._arrivals or arrival.board_s >= self._block_s + BLOCK_S:
            self._start_block(arrival, received_s)
        elif early or arrival.offset_s < self._arrivals[-1].offset_s:
            self._arrivals[-1] = arrival
            if early:
                self._fit()

    def _start_block(self, arrival: _Arrival, received_s: float) -> None:
        if self._slipped(received_s):
            del self._arrivals[:-1]
        self._block_s, self._block_received_s = arrival.board_s, received_s
        oldest_s = arrival.board_s - WINDOW_S
        self._arrivals = [kept for kept in self._arrivals if kept.board_s >= oldest_s]
        self._arrivals.append(arrival)
        self._fit()

    def _slipped(self, received_s: float) -> bool:
        """Return True if the finished block was received at normal speed, but later than the line."""
        if not self._arrivals or received_s - self._block_received_s < BLOCK_S / 2:
            return False
        board_s, offset_s = self._arrivals[-1]
        return offset_s - (self._slope * board_s + self._offset_s) > SLIP_S

    @property
    def _span_s(self) -> float:
        return self._arrivals[-1].board_s - self._arrivals[0].board_s if self._arrivals else 0.0

    def _fit(self) -> None:
        """Fit a line below all receptions, with the slope of their lower convex hull below the centroid."""
        arrivals = self._arrivals
        slope = _slope_at_centroid(arrivals) if self._span_s >= MIN_RATE_SPAN_S else 0.0
        self._slope = min(max(slope, -MAX_RATE_ERROR), MAX_RATE_ERROR)
        self._offset_s = min(offset_s - self._slope * board_s for board_s, offset_s in arrivals)
        self.out_of_tolerance = self._span_s >= MIN_FAULT_SPAN_S and abs(self.rate_error) > CLOCK_FAULT_ERROR


def _slope_at_centroid(arrivals: list[_Arrival]) -> float:
    """Return the slope of the lower convex hull (Andrew's monotone chain) at the mean board time."""
    hull: list[_Arrival] = []
    for arrival in arrivals:
        while len(hull) > 1 and _slope(hull[-2], hull[-1]) >= _slope(hull[-2], arrival):
            hull.pop()
        hull.append(arrival)
    centre_s = math.fsum(board_s for board_s, _ in arrivals) / len(arrivals)
    return next(_slope(a, b) for a, b in pairwise(hull) if b.board_s >= centre_s)


def _slope(a: _Arrival, b: _Arrival) -> float:
    return (b.offset_s - a.offset_s) / (b.board_s - a.board_s)
