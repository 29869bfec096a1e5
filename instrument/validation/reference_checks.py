"""Checks of an aligned reference force: signs of a wrong clock offset, a wrong unit and a wrong zero."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.calibration.contacts import MAX_ZERO_N
from pneuforce.instrument.recording.contact_table import RecordedContact
from pneuforce.instrument.validation.clock_offset import (
    MIN_CORRELATION,
    ClockOffset,
    Signal,
    estimate_offset,
    unknown_reason,
)
from pneuforce.instrument.validation.reference import FORCE_UNITS_N
from pneuforce.instrument.validation.reference_pairs import PressureCourse

#: Smallest difference between a given and an estimated offset that gives a warning. The lag of the tube, if
#: it is not calibrated, shifts an estimated offset by about half of this time.
MAX_OFFSET_DIFFERENCE_S = 0.2
#: Factor between the reference and the force of the instrument above which the unit is doubted. On a rubber
#: balloon, the force of the instrument without a calibration can be wrong by a factor of 2.5.
MAX_FORCE_FACTOR = 3.0


def offset_warning(given: ClockOffset, course: PressureCourse, reference: Signal) -> str:
    """Return a warning if the signals do not resemble each other at a given offset, otherwise ""."""
    if not course.contacts:
        return ""
    try:
        best = estimate_offset(course.signal, reference)
    except ConfigurationError:
        best = None
    differs = best is not None and abs(best.offset_s - given.offset_s) > MAX_OFFSET_DIFFERENCE_S
    if not differs and given.correlation >= MIN_CORRELATION:
        return ""
    if math.isnan(given.correlation):
        return (
            "the correlation of reference and pressure is not available with the given --offset, because "
            f"{unknown_reason(reference)}: check the offset and the files"
        )
    why = f"the correlation of reference and pressure is {given.correlation:.2f} with the given --offset"
    if best is not None and differs:
        better = f"with --offset {best.offset_s:.3f}, it is {best.correlation:.2f}"
        return f"{why}; {better}: check the offset"
    if given.correlation <= -MIN_CORRELATION:
        return f"{why}: the reference force is opposite: use --invert, or leave it out if it is given"
    return f"{why}: check the offset and the files"


def unit_warning(contacts: Sequence[RecordedContact], reference: Signal, unit: str) -> str:
    """Return a warning if another unit of the reference force is probable, otherwise "".

    The reference has the times of the recording. Its highest force in each contact is compared with that of
    the instrument.
    """
    factors = []
    for contact in contacts:
        first, last = np.searchsorted(reference.t_s, [contact.begin_s, contact.end_s])
        if last > first and contact.force_n > 0.0:
            factors.append(float(reference.value[first:last].max()) / contact.force_n)
    factor = float(np.median(factors)) if factors else math.nan
    if not factor > 0.0 or 1 / MAX_FORCE_FACTOR <= factor <= MAX_FORCE_FACTOR:
        return ""
    probable = min(
        FORCE_UNITS_N, key=lambda name: abs(math.log(FORCE_UNITS_N[unit] / FORCE_UNITS_N[name] / factor))
    )
    is_same = FORCE_UNITS_N[probable] == FORCE_UNITS_N[unit]
    remedy = (
        "check the reference sensor" if is_same else f"is its unit {probable}? Then use --unit {probable}"
    )
    return f"the reference force is {factor:.4g} times the force of the instrument: {remedy}"


def zero_warning(free_force_n: float) -> str:
    """Return a warning if the reference sensor does not read 0 without contact, otherwise ""."""
    if not abs(free_force_n) > MAX_ZERO_N:
        return ""
    return "the reference sensor does not read 0 without load: set it to zero, or use --tare"
