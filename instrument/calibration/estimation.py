"""Settings for an estimate of the force from two pressures, without a running instrument."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from pneuforce.instrument.calibration.apply import apply_calibration
from pneuforce.instrument.calibration.file import Calibration, load
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.model import ForceLaw

MAX_PRESSURE_KPA = 50.0  #: full scale of the sensor


class Grip(NamedTuple):
    """Grip of a contact as the user states it. None: the default, or the grip of the calibration."""

    value: float | None
    std: float | None


def estimation_settings(law: ForceLaw, grip: Grip, calibration: Path | Calibration | None) -> ChainSettings:
    """Return the settings of an estimate.

    A force calibration for another method is not used. Raises ConfigurationError if the calibration does not
    fit to the law.
    """
    chain = ChainSettings.of(law)
    if calibration is not None:
        content = load(calibration) if isinstance(calibration, Path) else calibration
        if content.force and content.force.made_for.method != law.method:
            content = content.model_copy(update={"force": None})
        chain = apply_calibration(chain, content)
    if grip.value is not None:
        chain = replace(chain, law=replace(chain.law, grip=grip.value))
    if grip.std is not None:
        chain = replace(chain, input_uncertainties=replace(chain.input_uncertainties, grip=grip.std))
    return chain


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
