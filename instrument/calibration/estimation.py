"""Settings for an estimate of the force from two pressures, without a running instrument."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.calibration.apply import apply_calibration, is_grip_unused
from pneuforce.instrument.calibration.file import Calibration
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.model import ForceLaw
from pneuforce.instrument.model.law import Low, MethodName, Switch

MAX_PRESSURE_KPA = 50.0  #: full scale of the sensor


class LawChoice(NamedTuple):
    """Force law as the user states it. None: the value of the calibration, otherwise that of the paper."""

    method: MethodName | None = None
    switch: Switch | None = None
    low: Low | None = None
    sides: int | None = None

    def law(self, calibration: Calibration | None) -> ForceLaw:
        """Return the law. A force calibration for another method than the stated method does not count."""
        made_for = calibration.force.made_for if calibration and calibration.force else None
        grip = calibration.grip if calibration else None
        paper = ForceLaw()
        method = self.method or (made_for.method if made_for else paper.method)
        if made_for is None or made_for.method != method:
            sides = grip.made_for.pressed_sides if grip and method == "membrane" else None
            switch, low = None, None
        else:
            switch, low, sides = made_for.switch, made_for.low, made_for.pressed_sides
        return ForceLaw(
            method=method,
            switch=self.switch or switch or paper.switch,
            low=self.low or low or paper.low,
            sides=self.sides or sides or paper.sides,
        )


class Grip(NamedTuple):
    """Grip of a contact as the user states it. None: the default, or the grip of the calibration."""

    value: float | None
    std: float | None


def estimation_settings(choice: LawChoice, grip: Grip, calibration: Calibration | None) -> ChainSettings:
    """Return the settings of an estimate. The law is that of the calibration, if the user does not state it.

    A force calibration for another method is not used. Raises ConfigurationError if the calibration does not
    fit to the law, or if an argument or the calibrated grip does not apply to the method.
    """
    law = choice.law(calibration)
    _check_applicable(law, choice, grip)
    if choice.method is None and calibration is not None and is_grip_unused(law.method, calibration):
        raise ConfigurationError(
            "the calibration has a grip but no force, and only the method membrane uses a grip: choose the "
            f"method membrane, or choose the method {law.method} to calculate without the grip"
        )
    chain = ChainSettings.of(law)
    if calibration is not None:
        if calibration.force and calibration.force.made_for.method != law.method:
            calibration = calibration.model_copy(update={"force": None})
        chain = apply_calibration(chain, calibration)
    if grip.value is not None:
        chain = replace(chain, law=replace(chain.law, grip=grip.value))
    if grip.std is not None:
        chain = replace(chain, input_uncertainties=replace(chain.input_uncertainties, grip=grip.std))
    return chain


def _check_applicable(law: ForceLaw, choice: LawChoice, grip: Grip) -> None:
    """Raise ConfigurationError if the user states a property that the method does not have."""
    stated: dict[str, object]
    if law.method == "membrane":
        stated, remedy = (
            {"switch": choice.switch, "low": choice.low},
            "state only what it has, or choose another method",
        )
    else:
        stated = {"grip": grip.value, "grip_std": grip.std, "pressed_sides": choice.sides}
        remedy = "choose the method membrane"
    names = [name for name, value in stated.items() if value is not None]
    if names:
        raise ConfigurationError(
            f"{', '.join(names)} cannot be used with the method {law.method}, which has no such property: "
            f"{remedy}"
        )


def pressure_problem(baseline_kpa: float, final_kpa: float, names: tuple[str, str]) -> str:
    """Return the reason why the pressures cannot belong to a contact; "" if they can.

    `names` are the names of the two pressures in the message.
    """
    baseline, final = names
    if not (math.isfinite(baseline_kpa) and math.isfinite(final_kpa)):
        return f"{baseline} and {final} must be finite pressures in kPa"
    if not baseline_kpa > 0:
        return f"{baseline} {baseline_kpa:g} is invalid: the balloon must be inflated, so ΔP_i is above 0 kPa"
    if not final_kpa > baseline_kpa:
        return f"{final} {final_kpa:g} is invalid: a contact raises the pressure above {baseline_kpa:g}"
    if not final_kpa <= MAX_PRESSURE_KPA:
        return f"{final} {final_kpa:g} is invalid: the sensor's full scale is {MAX_PRESSURE_KPA:g} kPa"
    return ""
