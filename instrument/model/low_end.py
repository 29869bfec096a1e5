"""Below a rise of 0.5 kPa: how the law, which does not go to zero with the rise, is joined to zero."""

from __future__ import annotations

import math
from typing import NamedTuple

from instrument.model.balloon import LOWEST_RISE_KPA, Balloon, Circuit, Number
from instrument.model.derivatives import Derivatives, Inputs, Slope
from instrument.model.force import Estimate, contact
from instrument.model.law import PAPER, Law


class LowEnd(NamedTuple):
    """The contact at a rise of 0.5 kPa, and the slopes of the join there over those of a line to zero."""

    estimate: Estimate
    force_shape: Number = 1.0  #: 1 for the line
    indentation_shape: Number = 1.0

    @classmethod
    def of(cls, initial_kpa: Number, balloon: Balloon, circuit: Circuit, law: Law = PAPER) -> LowEnd:
        """The low end at ΔP_i; arrays broadcast."""
        final_kpa = initial_kpa + LOWEST_RISE_KPA
        solved = contact(initial_kpa, final_kpa, balloon, circuit, law)
        if law.low == "line" or _none(solved.force_n):
            return cls(solved)
        inputs = Inputs(initial_kpa, final_kpa, balloon, circuit)
        return cls.smooth(solved, Derivatives(solved.indentation_mm, inputs, law).by(final_kpa=1.0))

    @classmethod
    def smooth(cls, solved: Estimate, slope: Slope) -> LowEnd:
        """The smooth join to a solved contact whose slopes by ΔP_f are known."""
        return cls(
            solved,
            LOWEST_RISE_KPA * slope.force_n / solved.force_n,
            LOWEST_RISE_KPA * slope.indentation_mm / solved.indentation_mm,
        )

    def join(self, rise_kpa: Number) -> Estimate:
        """The contact at a smaller rise; its contact radius follows from (1). No force without a rise."""
        share = (abs(rise_kpa) + rise_kpa) / (2 * LOWEST_RISE_KPA)
        low = self.estimate
        force = low.force_n * joined(share, self.force_shape)
        d = low.indentation_mm * joined(share, self.indentation_shape)
        gap = low.radius_mm - d
        a_squared = force * 1e3 / (math.pi * self._pressure_kpa(rise_kpa))
        return Estimate(force, d, a_squared**0.5, low.radius_mm, (a_squared + gap * gap) ** 0.5)

    def _pressure_kpa(self, rise_kpa: Number) -> Number:
        """ΔP_f at a smaller rise, from (1) at the low end."""
        low = self.estimate
        end_kpa = low.force_n * 1e3 / (math.pi * low.contact_radius_mm**2)
        return end_kpa - LOWEST_RISE_KPA + rise_kpa


def joined(share: Number, shape: Number) -> Number:
    """A curve from (0, 0) to (1, 1) with slope `shape` at its end: 2(1−m)√x + (2m−1)x, the line for m = 1.

    A flat disc on a soft sphere carries a force that grows like the square root of the volume that it takes.
    """
    return 2 * (1 - shape) * share**0.5 + (2 * shape - 1) * share


def joined_slope(share: Number, shape: Number) -> Number:
    """Derivative of `joined` by the share, at a share above 0."""
    return (1 - shape) / share**0.5 + (2 * shape - 1)


def estimate(
    initial_kpa: Number, final_kpa: Number, balloon: Balloon, circuit: Circuit, law: Law = PAPER
) -> Estimate:
    """Like `contact`, joined to zero below a rise of 0.5 kPa: the paper's line (Section V-C), or smooth."""
    rise_kpa = final_kpa - initial_kpa
    if isinstance(rise_kpa, float):
        if not rise_kpa < LOWEST_RISE_KPA:
            return contact(initial_kpa, final_kpa, balloon, circuit, law)
        return LowEnd.of(initial_kpa, balloon, circuit, law).join(rise_kpa)

    import numpy as np

    initial, rise = np.broadcast_arrays(np.asarray(initial_kpa, float), np.asarray(rise_kpa, float))
    bare = contact(initial, initial + rise, balloon, circuit, law)
    below = rise < LOWEST_RISE_KPA
    if not below.any():
        return bare
    with np.errstate(all="ignore"):
        join = LowEnd.of(initial[below], balloon, circuit, law).join(rise[below])
    for whole, part in zip(bare, join, strict=True):
        whole[below] = part
    return bare


def _none(force_n: Number) -> bool:
    return isinstance(force_n, float) and not math.isfinite(force_n)
