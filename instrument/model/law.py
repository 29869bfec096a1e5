"""Which law turns two pressures into a force: the method, and how its step and its low end are treated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from instrument.model.balloon import Balloon, Number, within

MethodName = Literal["energetic", "lulevich", "shanahan"]
Switch = Literal["paper", "blend"]
Low = Literal["line", "smooth"]
#: The blend reaches this far to either side of the switch; beyond, it is the paper's law.
BLEND_KPA = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Law:
    """The paper's law by default.

    `switch`: from stretching energy (5) to (4) at once at 8.85 kPa, or blended within ± 1 kPa. `low`: below
    a rise of 0.5 kPa a straight line to zero, or a curve that joins the law smoothly and starts as √rise.
    """

    method: MethodName = "energetic"
    switch: Switch = "paper"
    low: Low = "line"

    def small_strain(self, initial_kpa: Number, balloon: Balloon) -> Number:
        """Weight of stretching energy (4) at ΔP_i, the rest goes to (5); NaN stays NaN."""
        above = initial_kpa - balloon.switch_kpa
        if self.switch == "paper":
            return (above.real > 0) * 1.0
        t = within(0.5 + above.real / (2 * BLEND_KPA), 0.0, 1.0)
        slope = 3 * t * (1 - t) / BLEND_KPA
        return t * t * (3 - 2 * t) + slope * (above - above.real)  # which carries a complex step on


PAPER = Law()
#: What measures better on the simulated rubber balloon, see docs/model.md.
LIVE = Law(switch="blend", low="line")
