"""Soft tissue between balloon and ground: how far it gives way, and the force of a travel through both."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple, Protocol

from sim.plant import HARDEST_N

FINEST_MM = 1e-6
FINEST_N = 1e-14  # a Hertz body is infinitely soft at first: nanonewtons are micrometres
MOST_STEPS = 100
#: A first guess of how much force a millimetre more costs [N/mm]; the root does not depend on it.
USUAL_N_PER_MM = 0.5


class Tissue(Protocol):
    """What gives way to the balloon."""

    def indentation_mm(self, force_n: float) -> float:
        """How deep it is pressed in [mm] by a force [N]."""
        ...


class Rigid(NamedTuple):
    """A flat wall."""

    def indentation_mm(self, force_n: float) -> float:  # noqa: ARG002
        """Nothing."""
        return 0.0


class Spring(NamedTuple):
    """Linear tissue."""

    stiffness_n_per_mm: float

    def indentation_mm(self, force_n: float) -> float:
        """Depth [mm]."""
        return force_n / self.stiffness_n_per_mm


class HalfSpace(NamedTuple):
    """A deep, incompressible, elastic body under a hard sphere, by Hertz: F = 4/3 E/(1 − ν²) √R δ^1.5.

    K. L. Johnson, *Contact Mechanics*, eq. (4.23). The balloon counts as the sphere, though it is not hard.
    """

    modulus_kpa: float  #: Young's modulus
    radius_mm: float  #: of the sphere

    def indentation_mm(self, force_n: float) -> float:
        """Depth [mm]. kPa·mm² is mN."""
        n_per_mm_power = 4 / 3 * self.modulus_kpa / (1 - 0.5**2) * math.sqrt(self.radius_mm) * 1e-3
        return math.pow(force_n / n_per_mm_power, 2 / 3)


def force_at_travel(
    travel_mm: float, tissue: Tissue, balloon_mm: Callable[[float], float], near_n: float = 0.0
) -> float:
    """Force [N] at which balloon and tissue together give way by `travel_mm`, at most 20 N.

    `balloon_mm` is the balloon's indentation [mm] under a force [N]; both must rise with it. A secant, kept
    inside a bracket, that begins at `near_n`.
    """
    if not travel_mm > 0:
        return 0.0
    low_n, high_n = 0.0, HARDEST_N
    force_n = min(max(near_n, 0.0), high_n)
    before: tuple[float, float] | None = None
    for _ in range(MOST_STEPS):
        excess_mm = balloon_mm(force_n) + tissue.indentation_mm(force_n) - travel_mm
        low_n, high_n = (force_n, high_n) if excess_mm < 0 else (low_n, force_n)
        if abs(excess_mm) < FINEST_MM or high_n - low_n < FINEST_N:
            break
        next_n = force_n - excess_mm * _n_per_mm(force_n, excess_mm, before)
        before = force_n, excess_mm
        force_n = next_n if low_n < next_n < high_n else (low_n + high_n) / 2
    return force_n


def _n_per_mm(force_n: float, excess_mm: float, before: tuple[float, float] | None) -> float:
    if before is None or excess_mm == before[1]:
        return USUAL_N_PER_MM
    return (force_n - before[0]) / (excess_mm - before[1])
