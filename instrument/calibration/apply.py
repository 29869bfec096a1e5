"""Application of a calibration: chain settings in which measured values replace the defaults."""

from __future__ import annotations

import math
from dataclasses import replace

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.calibration.file import Calibration
from pneuforce.instrument.calibration.sections import (
    ForceConditions,
    ForcePart,
    GripConditions,
    GripPart,
    RadiusPart,
    rounded,
)
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.model import ForceCorrection
from pneuforce.instrument.model.balloon import SkinConstants
from pneuforce.instrument.model.correction import REFERENCE_BASELINE_KPA
from pneuforce.instrument.model.law import BLEND_KPA, MethodName
from pneuforce.instrument.model.method_uncertainty import GRIP_CALIBRATED, without_force_reference
from pneuforce.instrument.model.pressure_bins import RiseSpans
from pneuforce.instrument.model.uncertainty import ModelUncertainty
from pneuforce.support.toml_sections import Section

#: Keys of the radius part that are also fields of `Balloon`.
RADIUS_KEYS = ("rest_radius_mm", "radius_linear_mm_per_kpa", "radius_quadratic_mm_per_kpa2")
#: Number of fitted constants of the radius curve, and standard uncertainty of a caliper [mm].
RADIUS_CONSTANTS, CALIPER_STD_MM = 3, 0.01
#: Relative standard uncertainty of a calibrated lag due to the heat of the gas: rms error if the result is 0
#: to 10 % too short (docs/calibration.md). ±2 of it contain these errors.
LAG_HEAT_RELATIVE_STD = 0.1 / math.sqrt(3)
#: Configuration section of each key. Keys that are not listed belong to the section `balloon`.
CONFIGURATION_SECTIONS = {
    "method": "measurement",
    "switch": "measurement",
    "low": "measurement",
    "grip": "measurement",
    "pressed_sides": "measurement",
    "volume_mm3": "circuit",
    "tube_time_constant_s": "measurement",
}
#: Descriptions for messages, by key, of the constants that are fixed in a release and not configurable.
RELEASE_CONSTANTS = {
    "blend_kpa": "the width of the blend",
    "middle_kpa": "the ΔP_i at which p is 0",
}
#: Inputs whose error is the same in every contact of one balloon on one circuit. A force calibration
#: compensates these errors. The force errors that remain after the correction are in its residual.
COMPENSATED_INPUTS = (
    "radius_mm",
    "volume_mm3",
    "young_kpa",
    "rest_thickness_mm",
    "poisson",
    "grip",
)


def apply_calibration(settings: ChainSettings, calibration: Calibration) -> ChainSettings:
    """Return the settings with the values of the calibration.

    Raises ConfigurationError if the configured values contradict the calibration, or if the calibrated force
    is implausible.
    """
    from pneuforce.instrument.calibration.plausibility import check_force  # imports numpy

    for apply_part in (_apply_radius, _apply_volume, _apply_lag, _apply_grip, _apply_force):
        settings = apply_part(settings, calibration)
    check_force(settings)
    return settings


def force_conditions(settings: ChainSettings) -> ForceConditions:
    """Return the conditions under which a force calibration of these settings is valid."""
    law, balloon = settings.law, settings.balloon
    return ForceConditions(
        method=law.method,
        switch=law.switch,
        blend_kpa=BLEND_KPA,
        low=law.low,
        middle_kpa=REFERENCE_BASELINE_KPA,
        young_kpa=balloon.young_kpa,
        poisson=balloon.poisson,
        rest_radius_mm=balloon.rest_radius_mm,
        rest_thickness_mm=balloon.rest_thickness_mm,
        radius_linear_mm_per_kpa=balloon.radius_linear_mm_per_kpa,
        radius_quadratic_mm_per_kpa2=balloon.radius_quadratic_mm_per_kpa2,
        volume_mm3=settings.circuit.volume_mm3,
        grip=law.grip if law.method == "membrane" else None,
        pressed_sides=law.sides if law.method == "membrane" else None,
    )


def grip_conditions(settings: ChainSettings) -> GripConditions:
    """Return the conditions under which a grip that is calibrated with these settings is valid."""
    balloon = settings.balloon
    return GripConditions(
        pressed_sides=settings.law.sides,
        rest_radius_mm=balloon.rest_radius_mm,
        radius_linear_mm_per_kpa=balloon.radius_linear_mm_per_kpa,
        radius_quadratic_mm_per_kpa2=balloon.radius_quadratic_mm_per_kpa2,
        volume_mm3=settings.circuit.volume_mm3,
    )


def changed_conditions(settings: ChainSettings, force: ForcePart) -> list[str]:
    """Return a message for each value that differs between the settings and the force calibration."""
    return _differences("force", force_conditions(settings), force.made_for)


def changed_grip_conditions(settings: ChainSettings, grip: GripPart) -> list[str]:
    """Return a message for each value that differs between the settings and the grip calibration."""
    return _differences("grip", grip_conditions(settings), grip.made_for)


def _differences(name: str, conditions: Section, made_for: Section) -> list[str]:
    """Return a message for each value that differs. Only the method membrane has a grip and pressed sides."""
    if getattr(conditions, "method", None) != getattr(made_for, "method", None):
        unset = dict.fromkeys(("grip", "pressed_sides"))
        conditions, made_for = (each.model_copy(update=unset) for each in (conditions, made_for))
    return [
        f"{_display_name(key)} = {value!r}, but the {name} calibration was made for "
        f"{getattr(made_for, key)!r}"
        for key, value in conditions
        if value != getattr(made_for, key)
    ]


def _display_name(key: str) -> str:
    """Return the name of a key for a message: section and key, or a description of a release constant."""
    return RELEASE_CONSTANTS.get(key) or f"{CONFIGURATION_SECTIONS.get(key, 'balloon')}.{key}"


def _apply_radius(settings: ChainSettings, calibration: Calibration) -> ChainSettings:
    part = calibration.radius
    if part is None:
        return settings
    default = ChainSettings().balloon
    measured = {key: getattr(part, key) for key in RADIUS_KEYS}
    for key, value in measured.items():
        _check_agreement(key, getattr(settings.balloon, key), getattr(default, key), value)
    balloon = replace(settings.balloon, skin=_skin(part), **measured)
    return replace(
        settings,
        balloon=balloon,
        model_uncertainty=without_force_reference(settings.law, balloon),
        input_uncertainties=replace(settings.input_uncertainties, radius_mm=_radius_std_mm(part)),
    )


def _radius_std_mm(part: RadiusPart) -> float:
    """Return the standard uncertainty of the fitted radius curve [mm].

    The scatter of the points is averaged over the points. The error of the caliper is common to all points.
    """
    residual_mm = part.residual_mm if part.skin_residual_mm is None else part.skin_residual_mm
    return math.hypot(residual_mm * math.sqrt(RADIUS_CONSTANTS / part.points), CALIPER_STD_MM)


def _skin(part: RadiusPart) -> SkinConstants | None:
    """Return the constants of the skin, None in a file of an older release."""
    rest, c1, c2 = part.skin_rest_radius_mm, part.skin_c1_kpa_mm, part.skin_c2_kpa_mm
    if rest is None or c1 is None or c2 is None:
        return None
    return SkinConstants(rest_radius_mm=rest, c1_kpa_mm=c1, c2_kpa_mm=c2)


def _apply_volume(settings: ChainSettings, calibration: Calibration) -> ChainSettings:
    part = calibration.volume
    if part is None:
        return settings
    default = ChainSettings().circuit
    _check_agreement("volume_mm3", settings.circuit.volume_mm3, default.volume_mm3, part.volume_mm3)
    return replace(
        settings,
        circuit=replace(settings.circuit, volume_mm3=part.volume_mm3),
        input_uncertainties=replace(settings.input_uncertainties, volume_mm3=part.volume_std_mm3),
    )


def _apply_lag(settings: ChainSettings, calibration: Calibration) -> ChainSettings:
    part = calibration.lag
    if part is None:
        return settings
    _check_agreement(
        "tube_time_constant_s",
        settings.tube_time_constant_s,
        ChainSettings().tube_time_constant_s,
        part.tube_time_constant_s,
    )
    return replace(
        settings,
        tube_time_constant_s=part.tube_time_constant_s,
        lag_relative_std=math.hypot(part.tube_std_s / part.tube_time_constant_s, LAG_HEAT_RELATIVE_STD),
    )


def _check_agreement(key: str, configured: float, default: float, measured: float) -> None:
    """Raise ConfigurationError if a user configured a value that differs from the measured value.

    A value that equals the default counts as not configured, so that the measured value replaces it.
    """
    if rounded(configured) not in (rounded(default), measured):
        raise ConfigurationError(
            f"{_display_name(key)} = {configured!r} contradicts the calibration, which "
            f"measured {measured!r}: delete one of the two values"
        )


def is_grip_unused(method: MethodName, calibration: Calibration) -> bool:
    """Return True if the method does not use the grip, and the calibration has no force that replaces it."""
    return calibration.grip is not None and calibration.force is None and method != "membrane"


def _apply_grip(settings: ChainSettings, calibration: Calibration) -> ChainSettings:
    """Return the settings with the calibrated grip. Other methods than "membrane" do not use it."""
    part = calibration.grip
    if part is None or settings.law.method != "membrane":
        return settings
    changed = changed_grip_conditions(settings, part)
    if changed:
        raise ConfigurationError("; ".join(changed) + ": calibrate the grip again, or restore the old value")
    inputs = replace(
        settings.input_uncertainties,
        grip=part.grip_std,
        # The weight also shows the effect of a wrong V_c. P_0 is different: the weather changes P_0.
        volume_mm3=0.0,
    )
    return replace(
        settings,
        law=replace(settings.law, grip=part.grip),
        input_uncertainties=inputs,
        model_uncertainty=GRIP_CALIBRATED[settings.law.sides],
    )


def _apply_force(settings: ChainSettings, calibration: Calibration) -> ChainSettings:
    part = calibration.force
    if part is None:
        return settings
    changed = changed_conditions(settings, part)
    if changed:
        raise ConfigurationError("; ".join(changed) + ": calibrate the force again, or restore the old value")
    correction = ForceCorrection(
        constant=part.constant,
        by_rise=part.by_rise,
        by_initial=part.by_initial_per_kpa,
        by_both=part.by_both_per_kpa,
        by_step=part.by_step,
        law=settings.law,
        balloon=settings.balloon,
        rise_span_kpa=(part.rise_low_kpa, part.rise_high_kpa),
        baseline_span_kpa=(part.initial_low_kpa, part.initial_high_kpa),
        rise_spans_by_bin=_rise_spans(part),
        outside=settings.input_uncertainties,
    )
    residual = ModelUncertainty.constant(part.residual_share, part.residual_floor_n)
    # Without contacts in a pressure bin or at a rise, the correction is not known there: it keeps its last
    # value, and the uncertainty before the calibration is added.
    model = residual.within(correction.covered_spans, settings.model_uncertainty)
    inputs = replace(settings.input_uncertainties, **dict.fromkeys(COMPENSATED_INPUTS, 0.0))
    return replace(settings, correction=correction, model_uncertainty=model, input_uncertainties=inputs)


def _rise_spans(part: ForcePart) -> RiseSpans | None:
    if part.rise_spans_kpa is None:
        return None
    first, second, third, fourth, fifth = (
        (span[0], span[1]) if span else None for span in part.rise_spans_kpa
    )
    return first, second, third, fourth, fifth
