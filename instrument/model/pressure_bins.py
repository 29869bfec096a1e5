"""Pressure bins: the validated range of ΔP_i in five bins of equal width, as in Fig. 7.

The edge at 8.85 kPa is `Balloon.switch_kpa`.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

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


#: Largest distance between two near ΔP_i [kPa]. The board holds a setpoint within 0.1 kPa.
NEAR_KPA = 0.1
#: Largest ratio of two near rises. Noise and creep change the rise of a repeated contact by less than this.
NEAR_RATIO = 1.02


class CoveredSpan(NamedTuple):
    """Pressures in one bin that measurements represent."""

    rise_span_kpa: tuple[float, float]
    baseline_span_kpa: tuple[float, float] = (-math.inf, math.inf)


#: One span for each pressure bin, from the lowest ΔP_i to the highest. None: no pressure.
CoveredSpans = tuple[
    CoveredSpan | None, CoveredSpan | None, CoveredSpan | None, CoveredSpan | None, CoveredSpan | None
]
#: Smallest and largest rise [kPa] in each pressure bin, from the lowest ΔP_i to the highest. None: no rise.
RiseSpan = tuple[float, float] | None
RiseSpans = tuple[RiseSpan, RiseSpan, RiseSpan, RiseSpan, RiseSpan]


def covered_spans(rise_spans_kpa: RiseSpans, baseline_span_kpa: tuple[float, float]) -> CoveredSpans:
    """Return the pressures that measurements represent, from their rises in each bin and the span of ΔP_i.

    They represent rises that are near those of the bin. If the span of ΔP_i contains less than half of a
    bin, they represent only the part of the bin that is near this span.
    """
    low_kpa, high_kpa = baseline_span_kpa
    uncovered = uncovered_bins(low_kpa, high_kpa)
    near_kpa = (low_kpa - NEAR_KPA, high_kpa + NEAR_KPA)

    def covered(index: int, rises_kpa: RiseSpan) -> CoveredSpan | None:
        begin, end = BIN_EDGES_KPA[index : index + 2]
        if rises_kpa is None or max(begin, low_kpa) > min(end, high_kpa):
            return None
        near_rises_kpa = (rises_kpa[0] / NEAR_RATIO, rises_kpa[1] * NEAR_RATIO)
        return CoveredSpan(near_rises_kpa, near_kpa) if index in uncovered else CoveredSpan(near_rises_kpa)

    first, second, third, fourth, fifth = (covered(*numbered) for numbered in enumerate(rise_spans_kpa))
    return first, second, third, fourth, fifth


def are_covered(spans: CoveredSpans, baseline_kpa: float, rise_kpa: float) -> bool:
    """Return True if the span of the pressure bin of ΔP_i contains ΔP_i and the rise."""
    span = spans[pressure_bin_index(baseline_kpa)]
    if span is None:
        return False
    (low_kpa, high_kpa), (rise_low_kpa, rise_high_kpa) = span.baseline_span_kpa, span.rise_span_kpa
    return low_kpa <= baseline_kpa <= high_kpa and rise_low_kpa <= rise_kpa <= rise_high_kpa
