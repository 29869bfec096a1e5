"""From two pressures to one force: the bare law."""

from __future__ import annotations

import math
from typing import NamedTuple

from instrument.model.balloon import Balloon, Circuit, Number
from instrument.model.law import PAPER, Law
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


#: Samples solved at a time: what fits into a processor's cache is five times faster.
BLOCK = 4096
NO_FORCE = Estimate(math.nan, math.nan, math.nan, math.nan, math.nan)


def contact(
    initial_kpa: Number, final_kpa: Number, balloon: Balloon, circuit: Circuit, law: Law = PAPER
) -> Estimate:
    """The contact that raised the gauge pressure from ΔP_i to ΔP_f: eq. (8) = (1) solved for d, F by (1).

    Floats in, floats out; arrays broadcast. NaN where there is no physical root (V_b ≤ 0, for one).
    This is the bare law: it does not go to 0 with the rise (see `low_end.estimate`).
    """
    method = METHODS[law.method]
    if isinstance(initial_kpa, float) and isinstance(final_kpa, float):
        if not math.isfinite(initial_kpa + final_kpa):
            return NO_FORCE
        weight = law.small_strain(initial_kpa, balloon)
        return _solve(Pressed.between(initial_kpa, final_kpa, weight, balloon, circuit), method)

    import numpy as np

    initial, final = np.broadcast_arrays(np.asarray(initial_kpa, float), np.asarray(final_kpa, float))
    whole = Estimate(*(np.empty(initial.shape) for _ in Estimate._fields))
    flat_initial, flat_final = initial.ravel(), final.ravel()
    with np.errstate(all="ignore"):
        for start in range(0, initial.size, BLOCK):
            block = slice(start, start + BLOCK)
            p, q = flat_initial[block], flat_final[block]
            p = np.where(np.isfinite(p + q), p, np.nan)
            weight = law.small_strain(p, balloon)
            part = _solve(Pressed.between(p, q, weight, balloon, circuit), method)
            for values, solved in zip(whole, part, strict=True):
                values.reshape(-1)[block] = solved
    return whole


def _solve(pressed: Pressed, method: Method) -> Estimate:
    R = pressed.radius_mm
    low, high = method.lowest_mm(pressed), R * (1 - 1e-9)
    d = root_above(lambda d: method.balance(d, pressed), low, high, low + 0.4 * (high - low))
    rf = method.final_radius_mm(d, pressed)
    a_squared = rf * rf - (R - d) ** 2
    return Estimate(1e-3 * math.pi * pressed.final_kpa * a_squared, d, a_squared**0.5, R, rf)
