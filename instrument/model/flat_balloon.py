"""Largest pressure rise of a balloon: at this rise, the pressed part of the balloon contains almost no gas.

A larger force raises the pressure no further, because the tool carries it.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

from pneuforce.instrument.model.balloon import Balloon, Circuit, sphere_volume_mm3

if TYPE_CHECKING:
    from pneuforce.instrument.model.rubber import RubberSkin

#: Share of its free volume that the pressed part still contains at the largest rise.
REMAINING_SHARE = 0.1
#: Stretches at which the free balloon is computed. The interpolation between them errs by less than 1 Pa.
_STRETCH_COUNT, _MAX_STRETCH = 600, 2.5


def largest_rise_kpa(baseline_kpa: float, balloon: Balloon, circuit: Circuit, sides: int) -> float:
    """Return the rise [kPa] at which 90 % of the gas has left the pressed part of the balloon.

    With one pressed side, the pressed part is half of the balloon, otherwise the complete balloon. The free
    half has the shape of the free balloon at ΔP_f (`rubber.skin_of`). The gas law gives the volume
    of the gas. If the free half has no shape at a pressure, the result is at most the rise to this pressure.
    """
    import numpy as np

    skin = fitted_skin(balloon)
    stretch = np.linspace(1.0, _MAX_STRETCH, _STRETCH_COUNT)
    pressure, volume = skin.free_kpa(stretch), sphere_volume_mm3(skin.rest_radius_mm * stretch)
    stable = int(np.argmax(np.diff(pressure, append=-np.inf) <= 0)) + 1
    pressure, volume = pressure[:stable], volume[:stable]
    start_mm3 = circuit.volume_mm3 + sphere_volume_mm3(balloon.radius_mm(baseline_kpa))
    ratio = (circuit.ambient_kpa + baseline_kpa) / (circuit.ambient_kpa + pressure)
    gas_mm3 = start_mm3 * ratio ** (1 / circuit.polytropic) - circuit.volume_mm3
    pressed_share = sides / 2
    excess_mm3 = gas_mm3 - (1 - (1 - REMAINING_SHARE) * pressed_share) * volume
    # The excess falls with the pressure; numpy interpolates over rising values only.
    final_kpa = np.interp(0.0, -excess_mm3, pressure)
    return max(float(final_kpa) - baseline_kpa, 0.0)


@lru_cache(maxsize=8)
def fitted_skin(balloon: Balloon) -> RubberSkin:
    """Return the skin of a balloon. It is computed once."""
    from pneuforce.instrument.model.rubber import skin_of

    return skin_of(balloon)
