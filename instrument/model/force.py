"""From two pressures to one force: the law as the paper states it, its range, and its line to zero."""

from __future__ import annotations

import math
from typing import NamedTuple

from instrument.model.balloon import LOWEST_RISE_KPA, Balloon, Circuit, Number
from instrument.model.methods import METHODS, Method
from instrument.model.pressed import Pressed
from instrument.model.root import root_above


class Estimate(NamedTuple):
    """One contact: floats, or arrays of one shape; NaN where the model has no answer."""

    force_n: Number
    indentation_mm: Number
    contact_radius_mm: Number
    radius_mm: Number  #: R_i
    radius_final_mm: Number  #: R_f


NO_FORCE = Estimate(math.nan, math.nan, math.nan, math.nan, math.nan)


def contact(
    initial_kpa: Number, final_kpa: Number, balloon: Balloon, circuit: Circuit, method: str = "energetic"
) -> Estimate:
    """The contact that raised the gauge pressure from ΔP_i to ΔP_f: eq. (8) = (1) solved for d, F by (1).

    Floats in, floats out; arrays broadcast. NaN where there is no physical root (V_b ≤ 0, for one).
    This is the bare law: it does not go to 0 with the rise (see `estimate`).
    """
    if isinstance(initial_kpa, float) and isinstance(final_kpa, float):
        if not math.isfinite(initial_kpa + final_kpa):
            return NO_FORCE
        small_strain: Number = 1.0 if initial_kpa > balloon.switch_kpa else 0.0
        pressed = Pressed.between(initial_kpa, final_kpa, small_strain, balloon, circuit)
        return _solve(pressed, METHODS[method])

    import numpy as np

    initial, final = np.broadcast_arrays(np.asarray(initial_kpa, float), np.asarray(final_kpa, float))
    with np.errstate(all="ignore"):
        initial = np.where(np.isfinite(initial + final), initial, np.nan)
        small_strain = np.where(initial > balloon.switch_kpa, 1.0, 0.0)
        return _solve(Pressed.between(initial, final, small_strain, balloon, circuit), METHODS[method])


def _solve(pressed: Pressed, method: Method) -> Estimate:
    R = pressed.radius_mm
    low, high = method.lowest_mm(pressed), R * (1 - 1e-9)
    d = root_above(lambda d: method.balance(d, pressed), low, high, low + 0.4 * (high - low))
    rf = method.final_radius_mm(d, pressed)
    a_squared = rf * rf - (R - d) ** 2
    return Estimate(1e-3 * math.pi * pressed.final_kpa * a_squared, d, a_squared**0.5, R, rf)


def estimate(
    initial_kpa: Number, final_kpa: Number, balloon: Balloon, circuit: Circuit, method: str = "energetic"
) -> Estimate:
    """Like `contact`, with the paper's interpolation to zero below a rise of 0.5 kPa (Section V-C).

    There force and indentation are a straight line from no contact to their values at 0.5 kPa, and the
    contact radius follows from (1).
    """
    rise_kpa = final_kpa - initial_kpa
    if isinstance(rise_kpa, float):
        if not rise_kpa < LOWEST_RISE_KPA:
            return contact(initial_kpa, final_kpa, balloon, circuit, method)
        lowest = contact(initial_kpa, initial_kpa + LOWEST_RISE_KPA, balloon, circuit, method)
        return on_the_line(lowest, rise_kpa, final_kpa)

    import numpy as np

    law = contact(initial_kpa, np.maximum(final_kpa, initial_kpa + LOWEST_RISE_KPA), balloon, circuit, method)
    line = on_the_line(law, rise_kpa, final_kpa)
    below = rise_kpa < LOWEST_RISE_KPA
    return Estimate(*(np.where(below, low, high) for low, high in zip(line, law, strict=True)))


def on_the_line(lowest: Estimate, rise_kpa: Number, final_kpa: Number) -> Estimate:
    """The straight line from no contact to `lowest`, the contact at a rise of 0.5 kPa, at a smaller rise."""
    share = rise_kpa / LOWEST_RISE_KPA
    force, d = lowest.force_n * share, lowest.indentation_mm * share
    a = (abs(force) * 1e3 / (math.pi * final_kpa)) ** 0.5
    gap = lowest.radius_mm - d
    return Estimate(force, d, a, lowest.radius_mm, (a * a + gap * gap) ** 0.5)
