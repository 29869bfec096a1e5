"""Piecewise cubic of a force curve: nodes, segments between two nodes, and points of the curve."""

from __future__ import annotations

import math
from typing import NamedTuple

from pneuforce.instrument.model.derivatives import ContactDerivative
from pneuforce.instrument.model.force import NO_FORCE, ContactEstimate
from pneuforce.instrument.model.uncertainty import ForceSensitivity

UNKNOWN_SENSITIVITY = ForceSensitivity(math.nan, math.nan, math.nan, math.nan)

#: Coefficients of a cubic polynomial, from the constant to the cubic coefficient.
_Cubic = tuple[float, float, float, float]


class ForceCurvePoint(NamedTuple):
    """Contact at one rise, with the sensitivity of its force."""

    estimate: ContactEstimate
    sensitivity: ForceSensitivity
    plausible: bool = True  #: False if the force is NaN because the corrected force would be implausible


class CurveNode(NamedTuple):
    """Solved contact, its derivative with respect to ΔP_f, and the sensitivity of its force."""

    rise_kpa: float
    solved: ContactEstimate
    by_final: ContactDerivative
    sensitivity: ForceSensitivity

    @property
    def has_force(self) -> bool:
        """Return True if the model has a solution at this rise."""
        return math.isfinite(self.solved.force_n)


class CurveSegment(NamedTuple):
    """Curve between two nodes: cubics for force and indentation, a straight line for the sensitivity.

    The variable is the rise minus the rise of the left node.
    """

    rise_kpa: float  #: rise at the left node
    force: _Cubic
    indentation: _Cubic
    sensitivity: ForceSensitivity  #: sensitivity at the left node
    sensitivity_per_kpa: ForceSensitivity
    radius_mm: float
    end_kpa: float = math.inf  #: largest rise with a force

    @classmethod
    def between(cls, left: CurveNode, right: CurveNode) -> CurveSegment:
        """Return the segment between two neighbouring nodes."""
        width_kpa = right.rise_kpa - left.rise_kpa
        a, b, p, q = left.solved, right.solved, left.sensitivity, right.sensitivity
        force = _hermite(width_kpa, a.force_n, b.force_n, p.final_n_per_kpa, q.final_n_per_kpa)
        slopes = left.by_final.indentation_mm, right.by_final.indentation_mm
        indentation = _hermite(width_kpa, a.indentation_mm, b.indentation_mm, *slopes)
        sensitivity_per_kpa = ForceSensitivity(
            *((after - before) / width_kpa for before, after in zip(p, q, strict=True))
        )
        return cls(left.rise_kpa, force, indentation, p, sensitivity_per_kpa, a.radius_mm)

    def force_n(self, rise_kpa: float) -> float:
        """Return the force [N] for a pressure rise [kPa], NaN after the end of the model."""
        return _evaluate(rise_kpa - self.rise_kpa, self.force) if rise_kpa <= self.end_kpa else math.nan

    def at(self, rise_kpa: float, final_kpa: float) -> ForceCurvePoint:
        """Return the point of the curve at a rise. The contact radius follows from eq. (1)."""
        x = rise_kpa - self.rise_kpa
        force = self.force_n(rise_kpa)
        if not force > 0:
            # Far above the pressure limits, the force law is so steep that a cubic can undershoot zero.
            return ForceCurvePoint(NO_FORCE, UNKNOWN_SENSITIVITY)
        d = _evaluate(x, self.indentation)
        a_squared = force * 1e3 / (math.pi * final_kpa)
        gap = self.radius_mm - d
        final_radius = math.sqrt(a_squared + gap * gap)
        estimate = ContactEstimate(force, d, math.sqrt(a_squared), self.radius_mm, final_radius)
        (baseline, final, parameters, heat), slope = self.sensitivity, self.sensitivity_per_kpa
        return ForceCurvePoint(
            estimate,
            ForceSensitivity(
                baseline + x * slope[0], final + x * slope[1], parameters + x * slope[2], heat + x * slope[3]
            ),
        )


def _hermite(width: float, left: float, right: float, slope_left: float, slope_right: float) -> _Cubic:
    """Return the cubic with the given values and slopes at 0 and at `width`."""
    mean_slope = (right - left) / width
    quadratic = (3 * mean_slope - 2 * slope_left - slope_right) / width
    cubic = (slope_left + slope_right - 2 * mean_slope) / (width * width)
    return left, slope_left, quadratic, cubic


def _evaluate(x: float, coefficients: _Cubic) -> float:
    constant, linear, quadratic, cubic = coefficients
    return constant + x * (linear + x * (quadratic + x * cubic))
