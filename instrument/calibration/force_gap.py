"""Range of the force in which a force calibration has no contacts."""

from __future__ import annotations

import numpy as np

from pneuforce.support.columns import Numbers

#: Largest accepted distance between neighbouring forces, as a share of the range of all forces. 24 random
#: forces have a larger distance in less than 1 % of the cases.
MAX_GAP_SHARE = 0.3


def force_gap_warning(forces_n: Numbers) -> str:
    """Return a warning if a large part of the range between the contacts has no contact, otherwise ""."""
    ordered = np.sort(forces_n)
    gaps_n = np.diff(ordered)
    range_n = ordered[-1] - ordered[0]
    at = int(np.argmax(gaps_n))
    if not gaps_n[at] > MAX_GAP_SHARE * range_n:
        return ""
    return (
        f"no contact has a force between {ordered[at]:.2f} and {ordered[at + 1]:.2f} N, which is "
        f"{100 * gaps_n[at] / range_n:.0f} % of the range of the contacts: the errors of the calibration are "
        "not known there; add contacts with these forces"
    )
