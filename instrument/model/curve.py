"""The force along one contact: ΔP_i stays, ΔP_f moves, and what was solved once is remembered."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

from instrument.model.balloon import LOWEST_RISE_KPA, Balloon, Circuit
from instrument.model.correction import Correction
from instrument.model.derivatives import Derivatives, Inputs, Slope
from instrument.model.force import NO_FORCE, Estimate, contact
from instrument.model.law import PAPER, Law
from instrument.model.low_end import LowEnd, joined, joined_slope
from instrument.model.uncertainty import InputErrors, Spread, parameter_spreads_n

#: Rise from one solved contact to the next, as a ratio. Cubic pieces between them err by less than 1e-5 N.
RATIO = 1.15


#: Coefficients, of the constant first.
_Cubic = tuple[float, float, float, float]


class Point(NamedTuple):
    """One moment of the contact."""

    estimate: Estimate
    spread: Spread


class _Node(NamedTuple):
    """A solved contact and its derivatives by ΔP_f."""

    rise_kpa: float
    solved: Estimate
    by_final: Slope
    spread: Spread


class _Piece(NamedTuple):
    """Between two solved contacts: cubics in force and indentation, a straight line in the spread.

    All in powers of the rise above that of the first.
    """

    rise_kpa: float
    force: _Cubic
    indentation: _Cubic
    spread: Spread
    spread_per_kpa: Spread
    radius_mm: float

    @classmethod
    def between(cls, left: _Node, right: _Node) -> _Piece:
        width_kpa = right.rise_kpa - left.rise_kpa
        a, b, p, q = left.solved, right.solved, left.spread, right.spread
        force = _hermite(width_kpa, a.force_n, b.force_n, p.final_n_per_kpa, q.final_n_per_kpa)
        slopes = left.by_final.indentation_mm, right.by_final.indentation_mm
        indentation = _hermite(width_kpa, a.indentation_mm, b.indentation_mm, *slopes)
        spread_per_kpa = Spread(*((after - before) / width_kpa for before, after in zip(p, q, strict=True)))
        return cls(left.rise_kpa, force, indentation, p, spread_per_kpa, a.radius_mm)

    def force_n(self, rise_kpa: float) -> float:
        return _at(rise_kpa - self.rise_kpa, self.force)

    def at(self, rise_kpa: float, final_kpa: float) -> Point:
        x = rise_kpa - self.rise_kpa
        force = _at(x, self.force)
        if not force > 0:  # far beyond any balloon the law grows so steeply that a cubic swings below zero
            return Point(NO_FORCE, _UNKNOWN)
        d = _at(x, self.indentation)
        a_squared = force * 1e3 / (math.pi * final_kpa)
        gap = self.radius_mm - d
        final_radius = math.sqrt(a_squared + gap * gap)
        estimate = Estimate(force, d, math.sqrt(a_squared), self.radius_mm, final_radius)
        (initial, final, parameters, _), by = self.spread, self.spread_per_kpa
        return Point(estimate, Spread(initial + x * by[0], final + x * by[1], parameters + x * by[2]))


def _hermite(width: float, left: float, right: float, slope_left: float, slope_right: float) -> _Cubic:
    """Coefficients of the cubic with these values and slopes at 0 and at `width`."""
    mean = (right - left) / width
    bend = (3 * mean - 2 * slope_left - slope_right) / width
    twist = (slope_left + slope_right - 2 * mean) / (width * width)
    return left, slope_left, bend, twist


def _at(x: float, cubic: _Cubic) -> float:
    left, slope, bend, twist = cubic
    return left + x * (slope + x * (bend + x * twist))


@dataclass(slots=True)
class ContactCurve:
    """The law at one ΔP_i, solved where the pressure comes by for the first time; in between, cubics."""

    initial_kpa: float
    balloon: Balloon
    circuit: Circuit
    law: Law = PAPER
    correction: Correction | None = None
    errors: InputErrors = field(default_factory=InputErrors)
    _nodes: dict[int, _Node] = field(default_factory=dict)
    _pieces: dict[int, _Piece] = field(default_factory=dict)
    low_n: float = field(init=False)  #: lower limit of the law's range: the force at a rise of 0.5 kPa

    def __post_init__(self) -> None:
        node = self._node(0)
        self.low_n = self._calibrated(Point(node.solved, node.spread), LOWEST_RISE_KPA).estimate.force_n

    def at(self, rise_kpa: float) -> Point:
        """Contact and spread at ΔP_f − ΔP_i; NaN where the law has no solution."""
        return self._calibrated(self._by_law(rise_kpa), rise_kpa)

    def force_n(self, rise_kpa: float) -> float:
        """The force of `at` alone [N]."""
        if not LOWEST_RISE_KPA <= rise_kpa < math.inf:
            force: float = self.at(rise_kpa).estimate.force_n
            return force
        force = self._piece(rise_kpa).force_n(rise_kpa)
        if self.correction is not None:
            force *= self.correction.factor(rise_kpa, self.initial_kpa)
        return force

    def _calibrated(self, point: Point, rise_kpa: float) -> Point:
        if self.correction is None:
            return point
        return corrected(point, self.correction, self.initial_kpa, rise_kpa)

    def _by_law(self, rise_kpa: float) -> Point:
        if rise_kpa < LOWEST_RISE_KPA:
            return self._below(max(rise_kpa, 0.0))
        if not rise_kpa < math.inf:
            return Point(NO_FORCE, _UNKNOWN)
        return self._piece(rise_kpa).at(rise_kpa, self.initial_kpa + rise_kpa)

    def _piece(self, rise_kpa: float) -> _Piece:
        index = int(math.log(rise_kpa / LOWEST_RISE_KPA) / _LOG_RATIO)
        piece = self._pieces.get(index)
        if piece is None:
            piece = self._pieces[index] = _Piece.between(self._node(index), self._node(index + 1))
        return piece

    def _node(self, index: int) -> _Node:
        node = self._nodes.get(index)
        if node is None:
            node = self._nodes[index] = self._solve(LOWEST_RISE_KPA * RATIO**index)
        return node

    def _solve(self, rise_kpa: float) -> _Node:
        initial, final = self.initial_kpa, self.initial_kpa + rise_kpa
        solved = contact(initial, final, self.balloon, self.circuit, self.law)
        if not math.isfinite(solved.force_n):
            return _Node(rise_kpa, solved, _NO_SLOPE, _UNKNOWN)
        inputs = Inputs(initial, final, self.balloon, self.circuit)
        derivatives = Derivatives(solved.indentation_mm, inputs, self.law)
        by_initial, by_final = derivatives.by(initial_kpa=1.0), derivatives.by(final_kpa=1.0)
        parameters_n = math.hypot(*parameter_spreads_n(derivatives, self.errors).values())
        spread = Spread(by_initial.force_n, by_final.force_n, parameters_n)
        return _Node(rise_kpa, solved, by_final, spread)

    def _below(self, rise_kpa: float) -> Point:
        """On the join to zero; the parameters' share of the force is the low end's."""
        node = self._node(0)
        low_n, spread = node.solved.force_n, node.spread
        if not low_n > 0:
            return Point(NO_FORCE, _UNKNOWN)
        smooth = LowEnd.smooth(node.solved, node.by_final)
        low_end = LowEnd(node.solved) if self.law.low == "line" else smooth
        m, share = low_end.force_shape, rise_kpa / LOWEST_RISE_KPA
        g = joined(share, m)
        slope = low_n / LOWEST_RISE_KPA * joined_slope(max(share, _LEAST_SHARE), m)
        by_initial = g * (spread.initial_n_per_kpa + spread.final_n_per_kpa) - slope
        other = joined(share, smooth.force_shape) - share
        spread = Spread(by_initial, slope, g * spread.parameters_n, other * low_n)
        return Point(low_end.join(rise_kpa), spread)


def corrected(point: Point, correction: Correction, initial_kpa: float, rise_kpa: float) -> Point:
    """The point with its force calibrated: d stays the law's, the contact radius follows from (1)."""
    estimate, spread = point
    factor = correction.factor(rise_kpa, initial_kpa)
    force_n = estimate.force_n * factor
    by_initial, by_final = correction.log_slopes_per_kpa(rise_kpa, initial_kpa)
    return Point(
        estimate._replace(force_n=force_n, contact_radius_mm=estimate.contact_radius_mm * math.sqrt(factor)),
        Spread(
            factor * spread.initial_n_per_kpa + force_n * by_initial,
            factor * spread.final_n_per_kpa + force_n * by_final,
            factor * spread.parameters_n,
            factor * spread.join_n,
        ),
    )


_LOG_RATIO = math.log(RATIO)
#: A square root is infinitely steep at zero: its slope is taken where the pressure stands out of the noise.
_LEAST_SHARE = 0.02
_UNKNOWN = Spread(math.nan, math.nan, math.nan)
_NO_SLOPE = Slope(math.nan, math.nan)
