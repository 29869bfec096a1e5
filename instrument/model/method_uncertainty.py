"""Uncertainty of each method on balloons that are not calibrated with a force sensor.

The values were determined on the population of simulated balloons of `pneuforce accuracy`. They are chosen so
that 95 of 100 true forces lie within ±2u of the computed force. docs/accuracy.md gives the result for other
balloons of the population.
"""

from __future__ import annotations

from collections.abc import Mapping

from pneuforce.instrument.model.balloon import Balloon
from pneuforce.instrument.model.law import ForceLaw, MethodName
from pneuforce.instrument.model.uncertainty import ModelUncertainty

#: Uncertainty without a force sensor and without known weights, by method and number of pressed sides. The
#: published methods use the radius, thickness and stiffness of the paper, and "membrane" its radii.
UNCALIBRATED: Mapping[tuple[MethodName, int], ModelUncertainty] = {
    ("energetic", 1): ModelUncertainty(
        relative_stds=(0.28, 0.24, 0.19, 0.25, 0.01), absolute_stds_n=(0.01, 0.02, 0.22, 0.22, 0.54)
    ),
    ("energetic", 2): ModelUncertainty(
        relative_stds=(0.06, 0.07, 0.01, 0.01, 0.01), absolute_stds_n=(0.21, 0.33, 0.48, 0.51, 0.73)
    ),
    ("lulevich", 1): ModelUncertainty(
        relative_stds=(0.78, 0.59, 0.39, 0.23, 0.01), absolute_stds_n=(0.01, 0.01, 0.01, 0.34, 0.72)
    ),
    ("lulevich", 2): ModelUncertainty(
        relative_stds=(0.34, 0.22, 0.01, 0.01, 0.19), absolute_stds_n=(0.01, 0.18, 0.43, 0.62, 0.80)
    ),
    ("shanahan", 1): ModelUncertainty(
        relative_stds=(0.95, 0.76, 0.58, 0.45, 0.25), absolute_stds_n=(0.01, 0.01, 0.01, 0.01, 0.35)
    ),
    ("shanahan", 2): ModelUncertainty(
        relative_stds=(0.43, 0.31, 0.18, 0.01, 0.01), absolute_stds_n=(0.01, 0.01, 0.26, 0.40, 0.61)
    ),
    ("membrane", 1): ModelUncertainty(
        relative_stds=(0.05, 0.04, 0.06, 0.12, 0.24), absolute_stds_n=(0.01, 0.01, 0.01, 0.01, 0.01)
    ),
    ("membrane", 2): ModelUncertainty.constant(0.03, 0.01),
}
#: Uncertainty of the method "membrane" after the radii of the balloon were measured, by number of pressed
#: sides. The values also apply to skins that stick or slide completely.
RADIUS_CALIBRATED: Mapping[int, ModelUncertainty] = {
    1: ModelUncertainty(
        relative_stds=(0.045, 0.035, 0.035, 0.045, 0.075), absolute_stds_n=(0.0, 0.0, 0.0, 0.0, 0.0)
    ),
    2: ModelUncertainty.constant(0.0275),
}
#: Uncertainty of the method "membrane" after the grip was calibrated with known weights, by number of pressed
#: sides. At the ends of the range, the grip at the pressure of the weight is less accurate.
GRIP_CALIBRATED: Mapping[int, ModelUncertainty] = {
    1: ModelUncertainty(
        relative_stds=(0.026, 0.003, 0.003, 0.003, 0.055), absolute_stds_n=(0.0, 0.0, 0.0, 0.0, 0.0)
    ),
    2: ModelUncertainty.constant(0.003),
}


def without_force_reference(law: ForceLaw, balloon: Balloon) -> ModelUncertainty:
    """Return the uncertainty of a method without known weights and without a force sensor."""
    if law.method == "membrane" and balloon.is_measured:
        return RADIUS_CALIBRATED[law.sides]
    return UNCALIBRATED[law.method, law.sides]
