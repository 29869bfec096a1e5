"""All pressed shapes of one balloon: pressure and height by contact share and by the gas that it holds.

Gas is reckoned in the reference circuit: the paper's tubes on a standard day. It tells balloons apart past
the limit point too, where two of them have one pressure.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sim.membrane.material import Rubber
from sim.membrane.shooting import EQUATOR, Array, Shapes, press, slack
from sim.plant import AMBIENT_KPA, TUBES_MM3

#: Shares of the half meridian that lie on the plate.
SHARES = np.concatenate([[0.005, 0.01], np.linspace(0.02, 0.96, 48), [0.97, 0.98]])
SHARES_AT_ONCE = 13
#: How far the pole is stretched beyond the pole of a shape with no tension at the plate's edge.
BEYOND_SLACK = np.geomspace(5e-5, 1.0, 50)
NEARLY_SLACK = 0.01
#: Shapes of a column after it is filled in.
FILLED = 6000

Progress = Callable[[int, int], None]


@dataclass(frozen=True, slots=True)
class Column:
    """Shapes with one contact share, by rising gas."""

    gas_kpa_mm3: Array
    pressure_kpa: Array
    half_height_mm: Array
    contact_radius_mm: Array

    @property
    def highest_n(self) -> float:
        """Force of the shape with the most gas [N]."""
        return float(1e-3 * np.pi * self.pressure_kpa[-1] * self.contact_radius_mm[-1] ** 2)

    def at(self, gas_kpa_mm3: Array) -> Array:
        """Pressure, half height and contact radius (3, gases), NaN where the column does not reach."""
        values = (self.pressure_kpa, self.half_height_mm, self.contact_radius_mm)
        return np.stack([np.interp(gas_kpa_mm3, self.gas_kpa_mm3, v, np.nan, np.nan) for v in values])


def columns(rubber: Rubber, sides: int, progress: Progress) -> list[Column]:
    """One column for each of `SHARES`; `progress` hears how many are done, of how many."""
    done: list[Column] = []
    for shares in np.array_split(SHARES, -(-SHARES.size // SHARES_AT_ONCE)):
        angles = shares * EQUATOR
        poles = slack(rubber, angles)[0] + BEYOND_SLACK[:, None]
        shapes = press(rubber, poles.ravel(), np.broadcast_to(angles, poles.shape).ravel())
        done += _columns(rubber, shapes, poles.shape, sides)
        progress(len(done), SHARES.size)
    return done


def _columns(rubber: Rubber, shapes: Shapes, grid: tuple[int, int], sides: int) -> list[Column]:
    values = np.stack(
        [shapes.pressure_kpa, shapes.half_height_mm, shapes.contact_radius_mm, shapes.half_volume_mm3]
    ).reshape(4, *grid)
    return [_column(rubber, values[:, :, place], sides) for place in range(grid[1])]


def _column(rubber: Rubber, values: Array, sides: int) -> Column:
    """The part of a column where gas rises, from where all shapes exist to the most gas.

    It is filled in before the free half comes into it, whose size changes fast near a limit point.
    """
    from scipy.interpolate import CubicSpline

    # Near slack a shot may hit the equator the wrong way round: the pressure rises there with the stretch.
    falls = np.append(np.diff(values[0]) <= 0, False) & (BEYOND_SLACK < NEARLY_SLACK)
    wrong = np.flatnonzero(np.isnan(values).any(axis=0) | falls)
    first = int(wrong[-1]) + 1 if wrong.size else 0
    beyond = np.log(BEYOND_SLACK[first:])
    filled = CubicSpline(beyond, values[:, first:], axis=1)(np.linspace(beyond[0], beyond[-1], FILLED))
    pressure, height, contact, half = filled
    gas = reference_gas(pressure, half + (half if sides == 2 else _free_half_mm3(rubber, pressure, half)))
    falling = np.flatnonzero(np.diff(gas) <= 0)
    kept = slice(None, int(falling[0]) + 1 if falling.size else None)
    return Column(gas[kept], pressure[kept], height[kept], contact[kept])


def _free_half_mm3(rubber: Rubber, pressure_kpa: Array, pressed_mm3: Array) -> Array:
    """The half that the house holds: a free half sphere at the same pressure.

    Past the limit point no pressure tells its size; there it grows in proportion to the pressed half.
    """
    peak = int(np.argmax(pressure_kpa))
    volume = (
        2 / 3 * np.pi * (rubber.radius_mm * rubber.free_stretch(np.maximum.accumulate(pressure_kpa))) ** 3
    )
    grown: Array = volume * np.where(np.arange(volume.size) > peak, pressed_mm3 / pressed_mm3[peak], 1.0)
    return grown


def reference_gas(pressure_kpa: Array, volume_mm3: Array) -> Array:
    """Gas [kPa·mm³] of a balloon in the reference circuit."""
    return (pressure_kpa + AMBIENT_KPA) * (volume_mm3 + TUBES_MM3)


def reference_volume(pressure_kpa: Array, gas_kpa_mm3: Array) -> Array:
    """Volume [mm³] of the balloon that holds this gas at this pressure in the reference circuit."""
    return gas_kpa_mm3 / (pressure_kpa + AMBIENT_KPA) - TUBES_MM3
