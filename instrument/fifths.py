"""The validated range of ΔP_i in five parts, as in Fig. 7: 8.85 kPa sets off the last two."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from instrument.model.balloon import VALID_HIGH_KPA, VALID_LOW_KPA

COUNT = 5
EDGES_KPA = tuple(
    round(VALID_LOW_KPA + n * (VALID_HIGH_KPA - VALID_LOW_KPA) / COUNT, 2) for n in range(COUNT + 1)
)


def fifths_of(initial_kpa: NDArray[np.float64]) -> NDArray[np.int64]:
    """Number of each pressure's fifth, from 0. An edge is the lower one's; outside, the nearest counts."""
    return np.searchsorted(EDGES_KPA[1:-1], initial_kpa)
