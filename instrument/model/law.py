"""Force law: the method that computes a force from two pressures, and the variants of this method."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from pneuforce.instrument.model.balloon import Balloon, Number, clamp

PublishedMethod = Literal["energetic", "lulevich", "shanahan"]
MethodName = Literal["energetic", "lulevich", "shanahan", "membrane"]
Switch = Literal["paper", "blend"]
Low = Literal["line", "smooth"]
#: Half width of the blend around `Balloon.switch_kpa` [kPa]. At a ΔP_i outside the blend, both values of
#: `switch` give the same force.
BLEND_KPA = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ForceLaw:
    """Choice of the force law. The default is the law of the paper.

    `switch` selects the change from stretching energy (5) to (4) at ΔP_i = 8.85 kPa: "paper" is a step,
    "blend" is a gradual change within ±1 kPa. `low` selects the force below a rise of 0.5 kPa: "line" is a
    straight line to zero, "smooth" is a curve that starts as √rise and joins the law without a kink. The
    method "membrane" has no switch, and its force is always smooth.
    """

    method: MethodName = "energetic"
    switch: Switch = "paper"
    low: Low = "line"
    #: Method "membrane" only: 0 if the skin slides on what it touches, 1 if it sticks. The default is the
    #: middle, for an unknown grip.
    grip: float = 0.5
    sides: int = 1  #: method "membrane" only: number of sides on which the balloon is pressed

    def small_strain_weight(self, baseline_kpa: Number, balloon: Balloon) -> Number:
        """Return the weight of stretching energy (4) at ΔP_i. The weight of (5) is 1 minus this weight."""
        above = baseline_kpa - balloon.switch_kpa
        if self.switch == "paper":
            return (above.real > 0) * 1.0
        t = clamp(0.5 + above.real / (2 * BLEND_KPA), 0.0, 1.0)
        slope = 3 * t * (1 - t) / BLEND_KPA
        # The last term is zero for a real ΔP_i. It keeps the imaginary part for complex-step derivatives.
        return t * t * (3 - 2 * t) + slope * (above - above.real)


PAPER_LAW = ForceLaw()
#: Default of the live instrument. This law is more accurate on the simulated rubber balloon (docs/model.md).
LIVE_LAW = ForceLaw(switch="blend", low="line")
