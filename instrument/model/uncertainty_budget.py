"""Uncertainty budget of one contact: the contribution of each source to the uncertainty of the force."""

from __future__ import annotations

import math
from typing import NamedTuple

from pneuforce.instrument.model.correction import ForceCorrection
from pneuforce.instrument.model.curve import ContactCurve
from pneuforce.instrument.model.force_model import ForceModel
from pneuforce.instrument.model.method_uncertainty import without_force_reference
from pneuforce.instrument.model.uncertainty import (
    InputUncertainties,
    ModelUncertainty,
    contributions_n,
)

#: Default time since the start of the contact [s]. The baseline drifts and cannot be measured in this time.
CONTACT_S = 5.0
#: Label and unit of each parameter.
PARAMETER_LABELS = {
    "radius_mm": ("radius R_i", "mm"),
    "young_kpa": ("Young's modulus E", "kPa"),
    "rest_thickness_mm": ("thickness h_0", "mm"),
    "poisson": ("Poisson's ratio ν", ""),
    "volume_mm3": ("volume of the tubes V_c", "mm³"),
    "ambient_kpa": ("ambient pressure P_0", "kPa"),
    "grip": ("grip, 0 slides to 1 sticks", ""),
}
EXPONENT_LABEL = "gas exponent n, 1 at rest"


class BudgetLine(NamedTuple):
    """One source of uncertainty."""

    source: str
    std: float  #: standard uncertainty of the source
    unit: str
    force_n: float  #: contribution to the standard uncertainty of the force [N]


def compute_budget(
    baseline_kpa: float,
    final_kpa: float,
    force_model: ForceModel,
    correction: ForceCorrection | None = None,
    input_uncertainties: InputUncertainties | None = None,
    model_uncertainty: ModelUncertainty | None = None,
    contact_s: float = CONTACT_S,
) -> tuple[BudgetLine, ...]:
    """Return one line for each source of uncertainty. `contact_s` is the time since a sudden contact."""
    inputs = input_uncertainties or InputUncertainties()
    model = model_uncertainty or without_force_reference(force_model.law, force_model.balloon)
    rise_kpa, drift_kpa = final_kpa - baseline_kpa, inputs.drift_kpa_per_s * contact_s
    curve = ContactCurve(baseline_kpa, force_model, correction, inputs)
    point = curve.at(rise_kpa)
    pressures = inputs.after_step(baseline_kpa, final_kpa, contact_s)
    force_n, sensitivity = point.estimate.force_n, point.sensitivity
    _, by_final, by_gain, _, by_heat, by_law = contributions_n(force_n, sensitivity, pressures, inputs, model)
    by_baseline, by_drift = (
        sensitivity.baseline_n_per_kpa * std_kpa for std_kpa in (inputs.baseline_noise_kpa, drift_kpa)
    )
    exponent_std = inputs.polytropic * pressures.warm_share
    return (
        BudgetLine("noise of ΔP_i", inputs.baseline_noise_kpa, "kPa", abs(by_baseline)),
        BudgetLine("noise of ΔP_f", inputs.final_noise_kpa, "kPa", abs(by_final)),
        BudgetLine("sensor gain after zero adjustment", 100 * inputs.gain, "%", abs(by_gain)),
        BudgetLine(f"drift of ΔP_i in {contact_s:g} s", drift_kpa, "kPa", abs(by_drift)),
        *_parameter_lines(
            baseline_kpa, rise_kpa, sensitivity.parameters_n, force_model, curve.uncertainties_at(rise_kpa)
        ),
        BudgetLine(EXPONENT_LABEL, exponent_std, "", by_heat),
        BudgetLine("force law", by_law, "N", by_law),
    )


def _parameter_lines(
    baseline_kpa: float,
    rise_kpa: float,
    total_n: float,
    force_model: ForceModel,
    uncertainties: InputUncertainties,
) -> list[BudgetLine]:
    """Return one line for each parameter. `total_n` is the root of the sum of squares of their forces.

    Below the lowest rise, the contributions have the same ratios to each other as at this rise.
    """
    solved_kpa = max(rise_kpa, force_model.lowest_rise_kpa)
    stds_n = dict(force_model.parameter_stds_n(baseline_kpa, solved_kpa, uncertainties))
    del stds_n["polytropic"]  # it has a line of its own, because its part fades
    scale = total_n / (math.hypot(*stds_n.values()) or 1.0)  # a calibration can compensate all parameters
    return [
        BudgetLine(
            PARAMETER_LABELS[name][0], getattr(uncertainties, name), PARAMETER_LABELS[name][1], std_n * scale
        )
        for name, std_n in stds_n.items()
    ]


def combined_std_n(lines: tuple[BudgetLine, ...]) -> float:
    """Return the combined standard uncertainty of the force [N]."""
    return math.hypot(*(line.force_n for line in lines))
