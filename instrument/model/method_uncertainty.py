"""Uncertainty of each method on balloons that are not calibrated with a force sensor.

The values were determined on the population of simulated balloons of `pneuforce accuracy`. They are chosen so
that 95 of 100 true forces lie within ±2u of the computed force. docs/accuracy.md gives the result for other
balloons of the population.
"""

from __future__ import annotations

from collections.abc import Mapping

from pneuforce.instrument.model.law import MethodName
from pneuforce.instrument.model.uncertainty import ModelUncertainty

#: Uncertainty without a force sensor and without known weights, by method and number of pressed sides. The
#: published methods use the radius, thickness and stiffness of the paper.
UNCALIBRATED: Mapping[tuple[MethodName, int], ModelUncertainty] = {
    ("energetic", 1): ModelUncertainty(
        relative_stds=(0.27, 0.23, 0.18, 0.22, 0.05), absolute_stds_n=(0.02, 0.05, 0.22, 0.27, 0.58)
    ),
    ("energetic", 2): ModelUncertainty(
        relative_stds=(0.06, 0.06, 0.05, 0.05, 0.05), absolute_stds_n=(0.20, 0.34, 0.46, 0.51, 0.70)
    ),
    ("lulevich", 1): ModelUncertainty(
        relative_stds=(0.77, 0.55, 0.41, 0.15, 0.05), absolute_stds_n=(0.02, 0.02, 0.02, 0.43, 0.72)
    ),
    ("lulevich", 2): ModelUncertainty(
        relative_stds=(0.34, 0.21, 0.05, 0.05, 0.17), absolute_stds_n=(0.02, 0.21, 0.40, 0.62, 0.78)
    ),
    ("shanahan", 1): ModelUncertainty(
        relative_stds=(0.93, 0.75, 0.62, 0.45, 0.35), absolute_stds_n=(0.02, 0.02, 0.02, 0.02, 0.22)
    ),
    ("shanahan", 2): ModelUncertainty(
        relative_stds=(0.43, 0.31, 0.21, 0.05, 0.05), absolute_stds_n=(0.02, 0.02, 0.19, 0.41, 0.57)
    ),
    ("membrane", 1): ModelUncertainty.constant(0.01),
    ("membrane", 2): ModelUncertainty.constant(0.01),
}
#: Uncertainty of the method "membrane" after the grip was calibrated with known weights.
GRIP_CALIBRATED = ModelUncertainty.constant(0.008)


def uncalibrated(method: MethodName, sides: int) -> ModelUncertainty:
    """Return the uncertainty of a method without calibration."""
    return UNCALIBRATED[method, sides]
