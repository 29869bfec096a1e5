"""Force curve of one contact: ΔP_i is constant and ΔP_f varies. Solved contacts are cached."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from pneuforce.instrument.model.balloon import MIN_RISE_KPA
from pneuforce.instrument.model.correction import ForceCorrection
from pneuforce.instrument.model.curve_segment import (
    UNKNOWN_SENSITIVITY,
    CurveNode,
    CurveSegment,
    ForceCurvePoint,
)
from pneuforce.instrument.model.force import NO_FORCE
from pneuforce.instrument.model.force_model import ForceModel
from pneuforce.instrument.model.low_rise import LowRiseInterpolation, interpolant, interpolant_slope
from pneuforce.instrument.model.plausibility import ForceSpan, method_span, plausible_span
from pneuforce.instrument.model.uncertainty import ForceSensitivity, InputUncertainties

#: Ratio of the rises of neighbouring nodes. Cubics between such nodes err by less than 1e-5 N.
NODE_RATIO = 1.15
_LOG_RATIO = math.log(NODE_RATIO)
#: Smallest fraction of the lowest rise at which the slope is computed; at a smaller fraction, the slope at
#: this fraction is used. The smooth interpolation is infinitely steep at zero, and noise hides smaller rises.
_MIN_SLOPE_FRACTION = 0.02
#: Tolerance of the rise at which the model ends [kPa].
_END_TOLERANCE_KPA = 1e-3


@dataclass(slots=True)
class ContactCurve:
    """Force at one ΔP_i as a piecewise cubic. A node is solved when it is first needed."""

    baseline_kpa: float
    model: ForceModel
    correction: ForceCorrection | None = None
    uncertainties: InputUncertainties = field(default_factory=InputUncertainties)
    _nodes: dict[int, CurveNode] = field(default_factory=dict)
    _segments: dict[int, CurveSegment] = field(default_factory=dict)
    _method_spans: dict[int, ForceSpan] = field(default_factory=dict)  # forces of all methods at each node
    _alarm_forces_n: dict[int, float] = field(default_factory=dict)  # forces for alarms at each node
    _lower_range_limit_n: float | None = None  # None before the first use
    _largest_rise_kpa: float | None = None  # None before the first use
    _lowest_kpa: float = field(init=False)  # rise below which the force is interpolated to zero

    def __post_init__(self) -> None:
        self._lowest_kpa = self.model.lowest_rise_kpa

    @property
    def lower_range_limit_n(self) -> float:
        """Return the force at the lower limit of the measuring range [N]."""
        if self._lower_range_limit_n is None:
            self._lower_range_limit_n = self.at(self.model.lower_range_rise_kpa).estimate.force_n
        return self._lower_range_limit_n

    @property
    def largest_rise_kpa(self) -> float:
        """Return the rise [kPa] above which the balloon may be pressed flat, and the force may be too small.

        Contacts of a force calibration with a larger rise show that the balloon was not flat.
        """
        if self._largest_rise_kpa is None:
            measured_kpa = self.correction.largest_rise_kpa(self.baseline_kpa) if self.correction else 0.0
            self._largest_rise_kpa = max(self.model.largest_contact(self.baseline_kpa).rise_kpa, measured_kpa)
        return self._largest_rise_kpa

    def at(self, rise_kpa: float) -> ForceCurvePoint:
        """Return the contact and its sensitivity at a rise.

        Both are NaN if the force law has no solution, or if the corrected force would be implausible.
        """
        return self._correct(self._uncorrected(rise_kpa), rise_kpa)

    def uncertainties_at(self, rise_kpa: float) -> InputUncertainties:
        """Return the uncertainties of the inputs at a rise.

        A force calibration compensates errors of the inputs only where it has contacts. Up to one node inside
        the ends of the calibrated span, the larger uncertainties apply, because the curve interpolates
        between nodes.
        """
        correction = self.correction
        if correction is None or correction.outside is None:
            return self.uncertainties
        neighbours = (rise_kpa / NODE_RATIO, rise_kpa * NODE_RATIO)
        covered = all(correction.covers(rise, self.baseline_kpa) for rise in neighbours)
        return self.uncertainties if covered else correction.outside

    def force_n(self, rise_kpa: float) -> float:
        """Return only the force at a rise [N], without correction if the corrected force is implausible.

        Where the model has no solution, another model gives the force. An alarm can therefore always use this
        force. This method is faster than `at`.
        """
        if self._lowest_kpa <= rise_kpa < math.inf:
            force: float = self._segment(rise_kpa).force_n(rise_kpa)
        else:
            force = self._uncorrected(rise_kpa).estimate.force_n
        if not math.isfinite(force) and rise_kpa > 0:
            return self._alarm_force_n(rise_kpa)
        if self.correction is None or not math.isfinite(force):
            return force
        corrected: float = force * self.correction.factor(rise_kpa, self.baseline_kpa)
        return corrected if self._is_plausible(corrected, force, rise_kpa) else force

    def _alarm_force_n(self, rise_kpa: float) -> float:
        """Return the force of another model for alarms [N], linear between two nodes; NaN if it is not known.

        A node takes 0.3 ms with the method "membrane", which is too long for each sample of a contact.
        """
        if not rise_kpa < math.inf:
            return math.nan
        index = self._index(rise_kpa)
        share = (rise_kpa / self._node_kpa(index) - 1) / (NODE_RATIO - 1)
        left_n, right_n = self._alarm_node_n(index), self._alarm_node_n(index + 1)
        return left_n + share * (right_n - left_n)

    def _alarm_node_n(self, index: int) -> float:
        force_n = self._alarm_forces_n.get(index)
        if force_n is None:
            force_n = self.model.alarm_force_n(self.baseline_kpa, self._node_kpa(index))
            self._alarm_forces_n[index] = force_n
        return force_n

    def _correct(self, point: ForceCurvePoint, rise_kpa: float) -> ForceCurvePoint:
        if self.correction is None or not math.isfinite(point.estimate.force_n):
            return point
        corrected = apply_correction(point, self.correction, self.baseline_kpa, rise_kpa)
        if self._is_plausible(corrected.estimate.force_n, point.estimate.force_n, rise_kpa):
            return corrected
        return ForceCurvePoint(NO_FORCE, UNKNOWN_SENSITIVITY, plausible=False)

    def _is_plausible(self, corrected_n: float, law_n: float, rise_kpa: float) -> bool:
        """Return True if a corrected force lies within the limits of `plausible_span`.

        `law_n` is the force without correction. Below the lowest rise, the force at the lower range limit
        must be plausible too, because the interpolation to zero begins there.
        """
        if rise_kpa < self._lowest_kpa:
            if not math.isfinite(self.lower_range_limit_n):
                return False
            law_n = self._node(0).solved.force_n
        # The law is one of the methods. Near its force, the other methods need not be solved.
        if plausible_span(rise_kpa, ForceSpan(law_n, law_n)).contains(corrected_n):
            return True
        return bool(plausible_span(rise_kpa, self._methods_at(rise_kpa)).contains(corrected_n))

    def _methods_at(self, rise_kpa: float) -> ForceSpan:
        """Return the span of the forces of all methods. Below a rise of 0.5 kPa, return the span at 0.5 kPa.

        Between two nodes, the span is interpolated linearly. The error is below 1 %.
        """
        if rise_kpa < MIN_RISE_KPA:
            rise_kpa = MIN_RISE_KPA
        index = self._index(rise_kpa)
        share = (rise_kpa / self._node_kpa(index) - 1) / (NODE_RATIO - 1)
        (a, b), (c, d) = self._method_span(index), self._method_span(index + 1)
        return ForceSpan(a + share * (c - a), b + share * (d - b))

    def _method_span(self, index: int) -> ForceSpan:
        """Return the span of the forces of the methods at the rise of a node."""
        span = self._method_spans.get(index)
        if span is None:
            rise_kpa = max(self._node_kpa(index), MIN_RISE_KPA)
            model = self.model
            span = method_span(self.baseline_kpa, rise_kpa, model.balloon, model.circuit, model.law.switch)
            self._method_spans[index] = span
        return span

    def _uncorrected(self, rise_kpa: float) -> ForceCurvePoint:
        if rise_kpa < self._lowest_kpa:
            return self._interpolate_to_zero(max(rise_kpa, 0.0))
        if not rise_kpa < math.inf:
            return ForceCurvePoint(NO_FORCE, UNKNOWN_SENSITIVITY)
        return self._segment(rise_kpa).at(rise_kpa, self.baseline_kpa + rise_kpa)

    def _segment(self, rise_kpa: float) -> CurveSegment:
        index = self._index(rise_kpa)
        segment = self._segments.get(index)
        if segment is None:
            segment = self._segments[index] = self._segment_from(self._node(index), self._node(index + 1))
        return segment

    def _segment_from(self, left: CurveNode, right: CurveNode) -> CurveSegment:
        """Return the segment between two nodes. If the model ends between them, the segment ends there."""
        if right.has_force or not left.has_force:
            return CurveSegment.between(left, right)
        last, end_kpa = left, right.rise_kpa
        while end_kpa - last.rise_kpa > _END_TOLERANCE_KPA:
            node = self._solve((last.rise_kpa + end_kpa) / 2)
            last, end_kpa = (node, end_kpa) if node.has_force else (last, node.rise_kpa)
        if last is left:
            return CurveSegment.between(left, right)
        return CurveSegment.between(left, last)._replace(end_kpa=last.rise_kpa)

    def _index(self, rise_kpa: float) -> int:
        """Return the index of the node at or below a rise. Below the lowest rise, it is negative."""
        return math.floor(math.log(rise_kpa / self._lowest_kpa) / _LOG_RATIO)

    def _node_kpa(self, index: int) -> float:
        """Return the rise of a node [kPa]."""
        return float(self._lowest_kpa * NODE_RATIO**index)

    def _node(self, index: int) -> CurveNode:
        node = self._nodes.get(index)
        if node is None:
            node = self._nodes[index] = self._solve(self._node_kpa(index))
        return node

    def _solve(self, rise_kpa: float) -> CurveNode:
        solved, by_baseline, by_final = self.model.solve(self.baseline_kpa, rise_kpa)
        if not math.isfinite(solved.force_n):
            return CurveNode(rise_kpa, solved, by_final, UNKNOWN_SENSITIVITY)
        stds_n = dict(
            self.model.parameter_stds_n(self.baseline_kpa, rise_kpa, self.uncertainties_at(rise_kpa))
        )
        heat_n = stds_n.pop("polytropic")
        sensitivity = ForceSensitivity(
            by_baseline.force_n, by_final.force_n, math.hypot(*stds_n.values()), heat_n
        )
        return CurveNode(rise_kpa, solved, by_final, sensitivity)

    def _interpolate_to_zero(self, rise_kpa: float) -> ForceCurvePoint:
        """Return the point of the curve at a rise below the lowest rise.

        The uncertainty due to the parameters has the same ratio to the force as at the lowest rise.
        """
        node = self._node(0)
        end_n, end_sensitivity = node.solved.force_n, node.sensitivity
        if not end_n > 0:
            return ForceCurvePoint(NO_FORCE, UNKNOWN_SENSITIVITY)
        if self.model.law.low == "line":
            interpolation = LowRiseInterpolation(node.solved, lowest_rise_kpa=self._lowest_kpa)
        else:
            interpolation = LowRiseInterpolation.smooth(node.solved, node.by_final, self._lowest_kpa)
        m, fraction = interpolation.force_end_slope, rise_kpa / self._lowest_kpa
        g = interpolant(fraction, m)
        by_final = end_n / self._lowest_kpa * interpolant_slope(max(fraction, _MIN_SLOPE_FRACTION), m)
        by_baseline = g * (end_sensitivity.baseline_n_per_kpa + end_sensitivity.final_n_per_kpa) - by_final
        parameters_n, heat_n = end_sensitivity.parameters_n, end_sensitivity.heat_n
        sensitivity = ForceSensitivity(by_baseline, by_final, g * parameters_n, g * heat_n)
        return ForceCurvePoint(interpolation.at(rise_kpa), sensitivity)


def apply_correction(
    point: ForceCurvePoint, correction: ForceCorrection, baseline_kpa: float, rise_kpa: float
) -> ForceCurvePoint:
    """Return the point with the corrected force.

    The indentation does not change. The contact radius follows from eq. (1), and R_f from both.
    """
    estimate, sensitivity, _ = point
    factor = correction.factor(rise_kpa, baseline_kpa)
    force_n = estimate.force_n * factor
    by_baseline, by_final = correction.log_slopes_per_kpa(rise_kpa, baseline_kpa)
    radius_mm = estimate.contact_radius_mm * math.sqrt(factor)
    final_mm = math.hypot(radius_mm, estimate.radius_mm - estimate.indentation_mm)
    return ForceCurvePoint(
        estimate._replace(force_n=force_n, contact_radius_mm=radius_mm, radius_final_mm=final_mm),
        ForceSensitivity(
            factor * sensitivity.baseline_n_per_kpa + force_n * by_baseline,
            factor * sensitivity.final_n_per_kpa + force_n * by_final,
            factor * sensitivity.parameters_n,
            factor * sensitivity.heat_n,
        ),
    )
