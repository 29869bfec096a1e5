"""Plausible range of a calibrated force: limits relative to the forces of the three published methods.

A force calibration corrects errors of the force law of some ten percent. A correction that is many times
larger has another cause, for example a wrong unit of the reference force. docs/calibration.md gives the
reasons for the limits.
"""

from __future__ import annotations

import math
from typing import NamedTuple, get_args

from pneuforce.instrument.model.balloon import MIN_RISE_KPA, Balloon, Circuit, Number
from pneuforce.instrument.model.force import solve_contact
from pneuforce.instrument.model.law import ForceLaw, PublishedMethod, Switch

#: Largest plausible ratio of a calibrated force to the highest force of the published methods, and of their
#: lowest force to a calibrated force.
MAX_RATIO = 3.0
#: Rise below which the lower limit falls to zero in proportion to the rise [kPa]. The published methods do
#: not approach zero with the rise, but the force on a rubber balloon does.
LOWER_LIMIT_RISE_KPA = 2.0


class ForceSpan(NamedTuple):
    """Lowest and highest of several forces: floats, or arrays of equal shape. NaN if no force is known."""

    low_n: Number
    high_n: Number

    def contains(self, force_n: Number) -> Number:
        """Return True if the force lies within the span. NaN never lies within a span."""
        return (self.low_n <= force_n) & (force_n <= self.high_n)


def method_span(
    baseline_kpa: Number, rise_kpa: Number, balloon: Balloon, circuit: Circuit, switch: Switch
) -> ForceSpan:
    """Return the span of the forces of the published methods. Floats give floats; arrays are broadcast.

    A method without a solution is omitted. At a rise below 0.5 kPa, the forces are those at 0.5 kPa.
    """
    laws = [ForceLaw(method=method, switch=switch) for method in get_args(PublishedMethod)]
    if isinstance(baseline_kpa, float) and isinstance(rise_kpa, float):
        final_kpa = baseline_kpa + max(rise_kpa, MIN_RISE_KPA)
        forces = [solve_contact(baseline_kpa, final_kpa, balloon, circuit, law).force_n for law in laws]
        known = [force_n for force_n in forces if math.isfinite(force_n)]
        return ForceSpan(min(known, default=math.nan), max(known, default=math.nan))

    import numpy as np

    final = np.asarray(baseline_kpa) + np.maximum(rise_kpa, MIN_RISE_KPA)
    solved = np.array([solve_contact(baseline_kpa, final, balloon, circuit, law).force_n for law in laws])
    return ForceSpan(np.fmin.reduce(solved), np.fmax.reduce(solved))


def plausible_span(rise_kpa: Number, methods: ForceSpan) -> ForceSpan:
    """Return the span of the plausible forces at a rise. `methods` is the `method_span` at this rise.

    Below a rise of 0.5 kPa, the lower limit follows the straight line to zero. The upper limit follows the
    steepest smooth curve to zero (`low_rise.interpolant` with an end slope of 0).
    """
    fraction = _clamp_to_one(rise_kpa / MIN_RISE_KPA)
    share = fraction * _clamp_to_one(rise_kpa / LOWER_LIMIT_RISE_KPA)
    steepest = 2 * fraction**0.5 - fraction
    return ForceSpan(methods.low_n * share / MAX_RATIO, methods.high_n * steepest * MAX_RATIO)


def _clamp_to_one(x: Number) -> Number:
    """Return `x` limited to the span from 0 to 1. In contrast to `clamp`, a tiny `x` is not rounded."""
    positive = (abs(x) + x) / 2
    return positive - (abs(positive - 1) + (positive - 1)) / 2
