"""Pressure bins: the validated range of ΔP_i in five bins of equal width, as in Fig. 7.

The edge at 8.85 kPa is `Balloon.switch_kpa`.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable
from itertools import pairwise
from typing import TYPE_CHECKING

from pneuforce.instrument.model.balloon import VALID_HIGH_KPA, VALID_LOW_KPA

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

BIN_COUNT = 5
BIN_EDGES_KPA = tuple(
    round(VALID_LOW_KPA + n * (VALID_HIGH_KPA - VALID_LOW_KPA) / BIN_COUNT, 2) for n in range(BIN_COUNT + 1)
)


#: Share of a bin that a span of ΔP_i must contain, so that measurements in the span represent the bin.
MIN_COVERED_SHARE = 0.5


def uncovered_bins(low_kpa: float, high_kpa: float) -> tuple[int, ...]:
    """Return the indices of the bins of which less than half is between two pressures."""
    return tuple(
        index
        for index, (begin, end) in enumerate(pairwise(BIN_EDGES_KPA))
        if not min(end, high_kpa) - max(begin, low_kpa) >= MIN_COVERED_SHARE * (end - begin)
    )


def pressure_bin_indices(baseline_kpa: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the index of the bin of each pressure, from 0.

    A pressure on an edge belongs to the lower bin. A pressure outside the range belongs to the nearest bin.
    """
    import numpy as np

    return np.searchsorted(BIN_EDGES_KPA[1:-1], baseline_kpa)


def pressure_bin_index(baseline_kpa: float) -> int:
    """Return the index of the bin of one pressure, as `pressure_bin_indices` does for arrays."""
    return bisect_left(BIN_EDGES_KPA, baseline_kpa, 1, BIN_COUNT) - 1


#: Smallest and largest rise [kPa]. None: no rise.
RiseSpan = tuple[float, float] | None
#: One span of the rise for each pressure bin, from the lowest ΔP_i to the highest.
RiseSpans = tuple[RiseSpan, RiseSpan, RiseSpan, RiseSpan, RiseSpan]


def rise_spans(spans: Iterable[RiseSpan]) -> RiseSpans:
    """Return five spans as one value."""
    first, second, third, fourth, fifth = spans
    return first, second, third, fourth, fifth


def contains_rise(spans: RiseSpans, baseline_kpa: float, rise_kpa: float) -> bool:
    """Return True if the span of the pressure bin of ΔP_i contains the rise."""
    span = spans[pressure_bin_index(baseline_kpa)]
    return span is not None and span[0] <= rise_kpa <= span[1]
