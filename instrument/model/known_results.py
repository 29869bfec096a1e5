"""Known results of the force law, by which a running instrument checks its own arithmetic."""

from __future__ import annotations

import math

from pneuforce.instrument.model.balloon import Balloon, Circuit
from pneuforce.instrument.model.force import solve_contact
from pneuforce.instrument.model.law import ForceLaw, PublishedMethod

#: Force [N] that each method computes for the balloon of the paper, at ΔP_i = 5, 8 and 11 kPa and rises of 1,
#: 1 and 2 kPa.
KNOWN_N: dict[PublishedMethod, tuple[float, float, float]] = {
    "energetic": (0.7571816619, 1.4380119859, 2.3763175704),
    "lulevich": (0.5584145713, 1.2570657966, 2.7224070963),
    "shanahan": (0.4801681554, 1.0076792272, 2.0600025328),
}
_PRESSURES_KPA = ((5.0, 6.0), (8.0, 9.0), (11.0, 13.0))
_TOLERANCE_N = 1e-9


def computes_known_forces(method: PublishedMethod) -> bool:
    """Return True if this computer computes the known forces of a method, in less than 1 ms."""
    computed_n = (
        solve_contact(p, q, Balloon(), Circuit(), ForceLaw(method=method)) for p, q in _PRESSURES_KPA
    )
    return all(
        math.isclose(contact.force_n, known_n, abs_tol=_TOLERANCE_N)
        for contact, known_n in zip(computed_n, KNOWN_N[method], strict=True)
    )
