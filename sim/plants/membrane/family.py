"""All pressed shapes of a balloon: pressure and height as functions of contact fraction and amount of gas.

The amount of gas refers to the reference circuit: the tubes of the paper at standard atmospheric pressure.
The amount of gas identifies a shape. The pressure does not, because two shapes have the same pressure beyond
the limit point.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pneuforce.sim.plants.membrane.material import Rubber
from pneuforce.sim.plants.membrane.shooting import EQUATOR, Array, Shapes, press, slack_limit
from pneuforce.sim.plants.plant import AMBIENT_KPA, TUBES_MM3

#: Contact fractions: the part of the half meridian that lies on the plate.
CONTACT_FRACTIONS = np.concatenate([[0.005, 0.01], np.linspace(0.02, 0.96, 48), [0.97, 0.98]])
FRACTIONS_AT_ONCE = 13
#: Stretch at the pole, minus the pole stretch at which the tension at the edge of the plate is zero.
EXCESS_STRETCHES = np.geomspace(5e-5, 1.0, 50)
NEARLY_SLACK = 0.01
#: Number of shapes in a column after interpolation.
INTERPOLATED_SHAPES = 6000

#: Callback that receives the number of finished steps and the total number of steps.
ProgressCallback = Callable[[int, int], None]


@dataclass(frozen=True, slots=True)
class ShapeColumn:
    """Shapes with the same contact fraction, in the order of increasing amount of gas."""

    gas_kpa_mm3: Array
    pressure_kpa: Array
    half_height_mm: Array
    contact_radius_mm: Array

    @property
    def highest_n(self) -> float:
        """Return the highest force [N]: the force of the shape that contains the most gas."""
        return float(1e-3 * np.pi * self.pressure_kpa[-1] * self.contact_radius_mm[-1] ** 2)

    def at(self, gas_kpa_mm3: Array) -> Array:
        """Return an array with the rows pressure, half height and contact radius.

        Each amount of gas has a column. Amounts outside the range of the shapes give NaN.
        """
        values = (self.pressure_kpa, self.half_height_mm, self.contact_radius_mm)
        return np.stack([np.interp(gas_kpa_mm3, self.gas_kpa_mm3, v, np.nan, np.nan) for v in values])


def columns(rubber: Rubber, sides: int, progress: ProgressCallback) -> list[ShapeColumn]:
    """Return one column for each contact fraction. Call `progress(done, total)` repeatedly."""
    done: list[ShapeColumn] = []
    for fractions in np.array_split(CONTACT_FRACTIONS, -(-CONTACT_FRACTIONS.size // FRACTIONS_AT_ONCE)):
        angles = fractions * EQUATOR
        poles = slack_limit(rubber, angles)[0] + EXCESS_STRETCHES[:, None]
        shapes = press(rubber, poles.ravel(), np.broadcast_to(angles, poles.shape).ravel())
        done += _columns(rubber, shapes, poles.shape, sides)
        progress(len(done), CONTACT_FRACTIONS.size)
    return done


def _columns(rubber: Rubber, shapes: Shapes, grid: tuple[int, int], sides: int) -> list[ShapeColumn]:
    values = np.stack(
        [shapes.pressure_kpa, shapes.half_height_mm, shapes.contact_radius_mm, shapes.half_volume_mm3]
    ).reshape(4, *grid)
    return [_column(rubber, values[:, :, index], sides) for index in range(grid[1])]


def _column(rubber: Rubber, values: Array, sides: int) -> ShapeColumn:
    """Return the part of a column in which all shapes exist and the amount of gas increases.

    The values are interpolated before the volume of the free half is added, because that volume changes fast
    near a limit point.
    """
    from scipy.interpolate import CubicSpline

    # Near zero tension, the shooting method may find false solutions. True pressures rise with the stretch.
    falls = np.append(np.diff(values[0]) <= 0, False) & (EXCESS_STRETCHES < NEARLY_SLACK)
    wrong = np.flatnonzero(np.isnan(values).any(axis=0) | falls)
    first = int(wrong[-1]) + 1 if wrong.size else 0
    excess = np.log(EXCESS_STRETCHES[first:])
    spline = CubicSpline(excess, values[:, first:], axis=1)
    pressure, height, contact, half = spline(np.linspace(excess[0], excess[-1], INTERPOLATED_SHAPES))
    gas = reference_gas(pressure, half + (half if sides == 2 else _free_half_mm3(rubber, pressure, half)))
    falling = np.flatnonzero(np.diff(gas) <= 0)
    increasing = slice(None, int(falling[0]) + 1 if falling.size else None)
    return ShapeColumn(gas[increasing], pressure[increasing], height[increasing], contact[increasing])


def _free_half_mm3(rubber: Rubber, pressure_kpa: Array, pressed_mm3: Array) -> Array:
    """Return the volume of the balloon half in the holder [mm³]: a free half sphere at the same pressure.

    Beyond the limit point, the pressure does not determine the size of a sphere. The free half then grows in
    proportion to the pressed half.
    """
    peak = int(np.argmax(pressure_kpa))
    volume = (
        2 / 3 * np.pi * (rubber.radius_mm * rubber.free_stretch(np.maximum.accumulate(pressure_kpa))) ** 3
    )
    grown: Array = volume * np.where(np.arange(volume.size) > peak, pressed_mm3 / pressed_mm3[peak], 1.0)
    return grown


def reference_gas(pressure_kpa: Array, volume_mm3: Array) -> Array:
    """Return the amount of gas in balloon and tubes in the reference circuit [kPa·mm³]."""
    return (pressure_kpa + AMBIENT_KPA) * (volume_mm3 + TUBES_MM3)


def reference_volume(pressure_kpa: Array, gas_kpa_mm3: Array) -> Array:
    """Return the volume [mm³] of a balloon with this amount of gas and pressure in the reference circuit."""
    return gas_kpa_mm3 / (pressure_kpa + AMBIENT_KPA) - TUBES_MM3
