"""Rate of the clock of a reference sensor, from the times at which both signals show each contact."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from pneuforce.instrument.validation.clock_offset import MIN_CORRELATION, STEP_S, Signal
from pneuforce.instrument.validation.trial import Floats

#: Largest time difference of one contact that is searched, in both directions.
MAX_DIFFERENCE_S = 1.0
#: Time around the beginning of a contact in which the signals are compared.
BEFORE_S, AFTER_S = 1.0, 3.0
#: Fewest contacts that show a rate, and number of contacts that are used of a long recording.
MIN_CONTACTS, MAX_CONTACTS = 5, 60
#: Smallest drift from the first to the last contact that gives a warning, and its smallest ratio to the
#: scatter of the time differences.
MIN_DRIFT_S, MIN_DRIFT_RATIO = 0.1, 4.0


def rate_warning(begins_s: Sequence[float], recorded: Signal, reference: Signal) -> str:
    """Return a warning if the clocks run at different rates, otherwise "".

    Contacts begin at `begins_s`. The reference has the times of the recording. The time difference of the two
    signals is determined at each contact. Its trend is the median slope between all pairs of contacts.
    """
    every = max(1, math.ceil(len(begins_s) / MAX_CONTACTS))
    found = [(begin_s, _difference_s(begin_s, recorded, reference)) for begin_s in begins_s[::every]]
    known = np.array([pair for pair in found if math.isfinite(pair[1])])
    if len(known) < MIN_CONTACTS:
        return ""
    t_s, difference_s = known.T
    first, second = np.triu_indices(len(known), 1)
    slope = float(np.median((difference_s[second] - difference_s[first]) / (t_s[second] - t_s[first])))
    residual_s = difference_s - slope * t_s
    scatter_s = float(np.median(abs(residual_s - np.median(residual_s))))
    drift_s = abs(slope) * float(t_s[-1] - t_s[0])
    if drift_s < max(MIN_DRIFT_S, MIN_DRIFT_RATIO * scatter_s):
        return ""
    percent, slower = f"{100 * abs(slope):.2g} %", "slower" if slope > 0 else "faster"
    return (
        f"the clock of the reference is {percent} {slower} than that of the recording: from the first to the "
        f"last contact, they drift apart by {drift_s:.2f} s. Multiply the times of the reference by "
        f"{1 / (1 - slope):.5f}, or make shorter recordings"
    )


def _difference_s(begin_s: float, recorded: Signal, reference: Signal) -> float:
    """Return the time in the recording minus the time in the reference at one contact [s].

    The result is NaN if the signals do not resemble each other within `MAX_DIFFERENCE_S`.
    """
    t_s = np.arange(begin_s - BEFORE_S, begin_s + AFTER_S, STEP_S)
    steps = round(MAX_DIFFERENCE_S / STEP_S)
    shifts_s = np.arange(-steps, steps + 1) * STEP_S
    rise = np.interp(t_s, recorded.t_s, recorded.value)
    forces = np.interp(t_s - shifts_s[:, np.newaxis], reference.t_s, reference.value)
    correlations = _correlations(rise, forces)
    best = int(np.argmax(correlations))
    is_inside = 0 < best < len(shifts_s) - 1
    return float(shifts_s[best]) if is_inside and correlations[best] >= MIN_CORRELATION else math.nan


def _correlations(rise: Floats, forces: Floats) -> Floats:
    """Return the correlation of the rise with each row of forces, −1 for a constant signal."""
    with np.errstate(all="ignore"):  # a damaged recording may contain any number
        rise = rise - rise.mean()
        forces = forces - forces.mean(axis=1, keepdims=True)
        scale = np.sqrt((rise @ rise) * (forces * forces).sum(axis=1))
        return np.where(scale > 0.0, forces @ rise / scale, -1.0)
