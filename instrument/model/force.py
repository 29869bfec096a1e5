"""Solution of the force law for one contact: force and indentation, computed from two pressures."""

from __future__ import annotations

import math
from typing import NamedTuple

from pneuforce.instrument.model.balloon import Balloon, Circuit, Number
from pneuforce.instrument.model.contact_geometry import ContactGeometry
from pneuforce.instrument.model.law import PAPER_LAW, ForceLaw
from pneuforce.instrument.model.methods import METHODS, ForceMethod
from pneuforce.instrument.model.root import find_root


class ContactEstimate(NamedTuple):
    """Solved contact: floats, or arrays of equal shape. The values are NaN if there is no solution."""

    force_n: Number
    indentation_mm: Number  #: indentation d
    contact_radius_mm: Number  #: radius a of the contact area
    radius_mm: Number  #: radius R_i before the contact
    radius_final_mm: Number  #: radius R_f during the contact


#: Number of contacts of an array that are solved together. This number fits into the processor cache, which
#: makes the solution of a large array five times faster.
BLOCK_SIZE = 4096
NO_FORCE = ContactEstimate(math.nan, math.nan, math.nan, math.nan, math.nan)


def solve_contact(
    baseline_kpa: Number, final_kpa: Number, balloon: Balloon, circuit: Circuit, law: ForceLaw = PAPER_LAW
) -> ContactEstimate:
    """Return the contact that raises the gauge pressure from ΔP_i to ΔP_f.

    The balance of the method is solved for d, in the energetic method eq. (8) = (1). F then follows from
    eq. (1). Floats give floats; arrays are broadcast. All results are NaN if there is no physical root, for
    example if V_b ≤ 0. The force does not approach zero when the rise approaches zero; `low_rise.estimate`
    interpolates the force to zero.
    """
    method = METHODS[law.method]
    if isinstance(baseline_kpa, float) and isinstance(final_kpa, float):
        if not math.isfinite(baseline_kpa + final_kpa):
            return NO_FORCE
        weight = law.small_strain_weight(baseline_kpa, balloon)
        return _solve(ContactGeometry.between(baseline_kpa, final_kpa, weight, balloon, circuit), method)

    import numpy as np

    baseline, final = np.broadcast_arrays(np.asarray(baseline_kpa, float), np.asarray(final_kpa, float))
    result = ContactEstimate(*(np.empty(baseline.shape) for _ in ContactEstimate._fields))
    flat_baseline, flat_final = baseline.ravel(), final.ravel()
    with np.errstate(all="ignore"):
        for start in range(0, baseline.size, BLOCK_SIZE):
            block = slice(start, start + BLOCK_SIZE)
            p, q = flat_baseline[block], flat_final[block]
            p = np.where(np.isfinite(p + q), p, np.nan)
            weight = law.small_strain_weight(p, balloon)
            solved_block = _solve(ContactGeometry.between(p, q, weight, balloon, circuit), method)
            for values, solved in zip(result, solved_block, strict=True):
                values.reshape(-1)[block] = solved
    return result


def _solve(geometry: ContactGeometry, method: ForceMethod) -> ContactEstimate:
    R = geometry.radius_mm
    low, high = method.lower_bound_mm(geometry), R * (1 - 1e-9)
    d = find_root(lambda d: method.balance(d, geometry), low, high, low + 0.4 * (high - low))
    rf = method.final_radius_mm(d, geometry)
    a_squared = rf * rf - (R - d) ** 2
    return ContactEstimate(1e-3 * math.pi * geometry.final_kpa * a_squared, d, a_squared**0.5, R, rf)
