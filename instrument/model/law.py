"""Which law turns two pressures into a force: the method, and how its step and its low end are treated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from instrument.model.balloon import Balloon, Number

MethodName = Literal["energetic", "lulevich", "shanahan"]
Switch = Literal["paper", "blend"]
Low = Literal["line", "smooth"]
#: Half of the blend's change lies within ± 0.58 of this [kPa].
BLEND_KPA = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Law:
    """The paper's law by default.

    `switch`: from stretching energy (5) to (4) at once at 8.85 kPa, or blended around it. `low`: below a rise
    of 0.5 kPa a straight line to zero, or a curve that joins the law with its slope and starts like √rise.
    """

    method: MethodName = "energetic"
    switch: Switch = "paper"
    low: Low = "line"

    def small_strain(self, initial_kpa: Number, balloon: Balloon) -> Number:
        """Weight of stretching energy (4) at ΔP_i, the rest goes to (5); NaN stays NaN."""
        above = initial_kpa - balloon.switch_kpa
        if self.switch == "blend":
            x = above / BLEND_KPA
            return 0.5 + 0.5 * x / (1 + x * x) ** 0.5
        if isinstance(above, float | complex):
            return 1.0 if above.real > 0 else 0.0
        return (above.real > 0) * 1.0


PAPER = Law()
