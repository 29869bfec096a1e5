"""Tissue behind the balloon: its indentation under a force, and the force at a given travel of the tool."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple, Protocol

from pneuforce.sim.plants.plant import MAX_PUSH_N

TOLERANCE_MM = 1e-6
#: Tolerance of the force [N]. It is this small because a Hertz body is infinitely soft at zero force: a few
#: nanonewtons can indent it by a micrometre.
TOLERANCE_N = 1e-14
MAX_ITERATIONS = 100
#: First guess of the stiffness [N/mm]. The result does not depend on this guess.
TYPICAL_N_PER_MM = 0.5


class Tissue(Protocol):
    """Body that the balloon indents."""

    def indentation_mm(self, force_n: float) -> float:
        """Return the indentation of the tissue [mm] under a force [N]."""
        ...


class Rigid(NamedTuple):
    """Flat rigid wall."""

    def indentation_mm(self, force_n: float) -> float:  # noqa: ARG002
        """Return 0 mm."""
        return 0.0


class Spring(NamedTuple):
    """Linear tissue."""

    stiffness_n_per_mm: float

    def indentation_mm(self, force_n: float) -> float:
        """Return the indentation [mm]."""
        return force_n / self.stiffness_n_per_mm


class HalfSpace(NamedTuple):
    """Elastic, incompressible half-space under a rigid sphere (Hertz): F = 4/3 E/(1 − ν²) √R δ^1.5.

    Source: K. L. Johnson, *Contact Mechanics*, eq. (4.23). The balloon is treated as a rigid sphere, although
    it is soft.
    """

    modulus_kpa: float  #: Young's modulus
    radius_mm: float  #: radius of the sphere

    def indentation_mm(self, force_n: float) -> float:
        """Return the indentation [mm]. The factor 1e-3 converts kPa·mm² (mN) to N."""
        n_per_mm_power = 4 / 3 * self.modulus_kpa / (1 - 0.5**2) * math.sqrt(self.radius_mm) * 1e-3
        return math.pow(force_n / n_per_mm_power, 2 / 3)


def force_at_travel(
    travel_mm: float, tissue: Tissue, balloon_mm: Callable[[float], float], near_n: float = 0.0
) -> float:
    """Return the force [N] at which the indentations of balloon and tissue add up to `travel_mm`.

    The force is limited to 20 N. `balloon_mm` returns the indentation of the balloon [mm] under a force [N].
    Both indentations must increase with the force. The root is found by a bracketed secant method that starts
    at `near_n`.
    """
    if not travel_mm > 0:
        return 0.0
    low_n, high_n = 0.0, MAX_PUSH_N
    force_n = min(max(near_n, 0.0), high_n)
    before: tuple[float, float] | None = None
    for _ in range(MAX_ITERATIONS):
        excess_mm = balloon_mm(force_n) + tissue.indentation_mm(force_n) - travel_mm
        low_n, high_n = (force_n, high_n) if excess_mm < 0 else (low_n, force_n)
        if abs(excess_mm) < TOLERANCE_MM or high_n - low_n < TOLERANCE_N:
            break
        next_n = force_n - excess_mm * _stiffness_n_per_mm(force_n, excess_mm, before)
        before = force_n, excess_mm
        force_n = next_n if low_n < next_n < high_n else (low_n + high_n) / 2
    return force_n


def _stiffness_n_per_mm(force_n: float, excess_mm: float, before: tuple[float, float] | None) -> float:
    """Return the slope of the secant through the present point and the point before it [N/mm]."""
    if before is None or excess_mm == before[1]:
        return TYPICAL_N_PER_MM
    return (force_n - before[0]) / (excess_mm - before[1])
