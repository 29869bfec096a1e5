"""Interpolation of the contact to zero force at rises below 0.5 kPa.

The result of the force law alone does not approach zero when the rise approaches zero.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from pneuforce.instrument.model.balloon import MIN_RISE_KPA, Balloon, Circuit, Number
from pneuforce.instrument.model.derivatives import ContactDerivative, ContactDifferentiator, ModelInputs
from pneuforce.instrument.model.force import ContactEstimate, solve_contact
from pneuforce.instrument.model.law import PAPER_LAW, ForceLaw


class LowRiseInterpolation(NamedTuple):
    """Interpolation between no contact and the contact at the lowest rise of a model (0.5 kPa in the paper).

    The slopes are those of the interpolation at this rise, divided by the slope of a straight line to zero.
    """

    end: ContactEstimate  #: contact at the lowest rise
    force_end_slope: Number = 1.0  #: slope of the force; 1 for the straight line
    indentation_end_slope: Number = 1.0
    lowest_rise_kpa: float = MIN_RISE_KPA

    @classmethod
    def at_baseline(
        cls, baseline_kpa: Number, balloon: Balloon, circuit: Circuit, law: ForceLaw = PAPER_LAW
    ) -> LowRiseInterpolation:
        """Return the interpolation at ΔP_i. Arrays are broadcast."""
        final_kpa = baseline_kpa + MIN_RISE_KPA
        end = solve_contact(baseline_kpa, final_kpa, balloon, circuit, law)
        if law.low == "line" or _has_no_solution(end.force_n):
            return cls(end)
        inputs = ModelInputs(baseline_kpa, final_kpa, balloon, circuit)
        return cls.smooth(end, ContactDifferentiator(end.indentation_mm, inputs, law).by(final_kpa=1.0))

    @classmethod
    def smooth(
        cls, end: ContactEstimate, by_final: ContactDerivative, lowest_rise_kpa: float = MIN_RISE_KPA
    ) -> LowRiseInterpolation:
        """Return the smooth interpolation between no contact and the contact `end`.

        `by_final` is the derivative of `end` with respect to ΔP_f.
        """
        return cls(
            end,
            lowest_rise_kpa * by_final.force_n / end.force_n,
            lowest_rise_kpa * by_final.indentation_mm / end.indentation_mm,
            lowest_rise_kpa,
        )

    def at(self, rise_kpa: Number) -> ContactEstimate:
        """Return the contact at a rise of at most the lowest rise. The contact radius follows from eq. (1).

        The force is zero if the rise is zero or negative.
        """
        fraction = (abs(rise_kpa) + rise_kpa) / (2 * self.lowest_rise_kpa)
        end = self.end
        force = end.force_n * interpolant(fraction, self.force_end_slope)
        d = end.indentation_mm * interpolant(fraction, self.indentation_end_slope)
        gap = end.radius_mm - d
        a_squared = force * 1e3 / (math.pi * self._final_kpa(rise_kpa))
        return ContactEstimate(force, d, a_squared**0.5, end.radius_mm, (a_squared + gap * gap) ** 0.5)

    def _final_kpa(self, rise_kpa: Number) -> Number:
        """Return ΔP_f at a rise [kPa].

        ΔP_f at the lowest rise follows from eq. (1) with the force and the contact radius of `end`.
        """
        end_kpa = self.end.force_n * 1e3 / (math.pi * self.end.contact_radius_mm**2)
        return end_kpa - self.lowest_rise_kpa + rise_kpa


def interpolant(fraction: Number, end_slope: Number) -> Number:
    """Return 2(1−m)√x + (2m−1)x with x = `fraction` and m = `end_slope`.

    The curve runs from (0, 0) to (1, 1) and has the slope m at (1, 1). For m = 1, the curve is a straight
    line. The square root is physical: the force of a flat disc on a soft sphere grows like the square root of
    the displaced volume.
    """
    return 2 * (1 - end_slope) * fraction**0.5 + (2 * end_slope - 1) * fraction


def interpolant_slope(fraction: Number, end_slope: Number) -> Number:
    """Return the derivative of `interpolant` with respect to `fraction`, which must be above 0."""
    return (1 - end_slope) / fraction**0.5 + (2 * end_slope - 1)


def estimate(
    baseline_kpa: Number, final_kpa: Number, balloon: Balloon, circuit: Circuit, law: ForceLaw = PAPER_LAW
) -> ContactEstimate:
    """Return the contact, interpolated to zero force below a rise of 0.5 kPa.

    At a rise of 0.5 kPa or more, the result is that of `solve_contact`. At a smaller rise, `law.low` selects
    the straight line of the paper (Section V-C) or the smooth curve. Floats give floats; arrays are
    broadcast.
    """
    rise_kpa = final_kpa - baseline_kpa
    if isinstance(rise_kpa, float):
        if not rise_kpa < MIN_RISE_KPA:
            return solve_contact(baseline_kpa, final_kpa, balloon, circuit, law)
        return LowRiseInterpolation.at_baseline(baseline_kpa, balloon, circuit, law).at(rise_kpa)

    import numpy as np

    baseline, rise = np.broadcast_arrays(np.asarray(baseline_kpa, float), np.asarray(rise_kpa, float))
    result = solve_contact(baseline, baseline + rise, balloon, circuit, law)
    below = rise < MIN_RISE_KPA
    if not below.any():
        return result
    with np.errstate(all="ignore"):
        interpolated = LowRiseInterpolation.at_baseline(baseline[below], balloon, circuit, law).at(
            rise[below]
        )
    for values, low_values in zip(result, interpolated, strict=True):
        values[below] = low_values
    return result


def _has_no_solution(force_n: Number) -> bool:
    return isinstance(force_n, float) and not math.isfinite(force_n)
