"""Table of the membrane plant: pressure and height by amount of gas and force, in the reference circuit.

The rows are equidistant in the amount of gas. The columns are equidistant in √(force / highest force of the
row), because the contact radius is proportional to √force at small forces.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneuforce.sim.plants.membrane.family import ProgressCallback, columns, reference_gas, reference_volume
from pneuforce.sim.plants.membrane.material import Rubber
from pneuforce.sim.plants.membrane.shooting import EQUATOR, Array, slack_limit
from pneuforce.sim.plants.plant import AMBIENT_KPA, MAX_PUSH_N, TUBES_MM3

ROWS, COLUMNS = 400, 160
MIN_FREE_KPA, MAX_FREE_STRETCH = 0.05, 1.85
FINE_POINTS = 20_001


@dataclass(frozen=True, slots=True)
class MembraneTable:
    """Table of one balloon.

    In column 0 the balloon is free. In the last column it is completely flat, or pressed with `MAX_PUSH_N`.
    """

    gas_kpa_mm3: Array  #: amount of gas (rows,)
    highest_n: Array  #: force in the last column (rows,)
    pressure_kpa: Array  #: pressure in the balloon (rows, columns)
    half_height_mm: Array  #: distance from the plate to the equator (rows, columns)


@dataclass(frozen=True, slots=True)
class _Paths:
    """Shapes of each row, from the free to the flat balloon: arrays (rows, nodes). Missing shapes are NaN."""

    pressure_kpa: Array
    half_height_mm: Array
    contact_radius_mm: Array


def compute_table(
    rubber: Rubber, sides: int, progress: ProgressCallback = lambda _done, _total: None
) -> MembraneTable:
    """Return the table of a balloon that is pressed on one or two `sides`.

    `progress(done, total)` is called during the computation. Raises ArithmeticError if the shooting method
    does not find all shapes of the rubber.
    """
    stretch = np.linspace(1.0, MAX_FREE_STRETCH, FINE_POINTS)
    free_kpa = rubber.free_kpa(stretch)
    free_gas = reference_gas(free_kpa, 4 / 3 * np.pi * (rubber.radius_mm * stretch) ** 3)
    least = int(np.argmax(free_kpa > MIN_FREE_KPA))
    gas = np.linspace(free_gas[least], free_gas[-1], ROWS)
    stretch = np.interp(gas, free_gas, stretch)
    free = np.stack([rubber.free_kpa(stretch), rubber.radius_mm * stretch, 0.0 * gas])
    found = columns(rubber, sides, progress)
    if any(column.gas_kpa_mm3[-1] < gas[-1] and column.highest_n < MAX_PUSH_N for column in found):
        raise ArithmeticError(
            f"some pressed shapes of {rubber} were not found: use constants closer to the defaults"
        )
    nodes = np.stack([free, *(column.at(gas) for column in found), _flat(rubber, sides, gas)], axis=2)
    first = int(np.searchsorted(gas, max(column.gas_kpa_mm3[0] for column in found)))
    return _resampled(gas, _extended(_Paths(*nodes), gas, first))


def _flat(rubber: Rubber, sides: int, gas: Array) -> Array:
    """Return pressure, half height and contact radius of completely flat sides, as an array (3, rows).

    The tension at the rim of a flat side is zero. Therefore, its radius does not depend on the pressure.
    """
    pressure = np.linspace(-1.0, 400.0, FINE_POINTS)
    held = 2 / 3 * np.pi * (rubber.radius_mm * rubber.free_stretch(pressure)) ** 3 * (2 - sides)
    flat_kpa = np.interp(gas, reference_gas(pressure, held), pressure)
    radius = slack_limit(rubber, np.array([EQUATOR]))[1]
    return np.stack([flat_kpa, 0.0 * gas, radius + 0.0 * gas])


def _extended(paths: _Paths, gas: Array, first: int) -> _Paths:
    """Return the paths with shapes for the rows below `first`, which the family does not contain.

    In these rows, the skin wrinkles and hardly stretches. The shapes are those of row `first`, scaled to the
    free radius of each row. The gas law gives the pressure.
    """
    scale = (paths.half_height_mm[:first, 0] / paths.half_height_mm[first, 0])[:, None]
    volume = reference_volume(paths.pressure_kpa[first], gas[first]) * scale**3
    wrinkled = _Paths(
        gas[:first, None] / (volume + TUBES_MM3) - AMBIENT_KPA,
        paths.half_height_mm[first] * scale,
        paths.contact_radius_mm[first] * scale,
    )
    return _Paths(
        np.concatenate([wrinkled.pressure_kpa, paths.pressure_kpa[first:]]),
        np.concatenate([wrinkled.half_height_mm, paths.half_height_mm[first:]]),
        np.concatenate([wrinkled.contact_radius_mm, paths.contact_radius_mm[first:]]),
    )


def _resampled(gas: Array, paths: _Paths) -> MembraneTable:
    """Return the table of the paths, interpolated at equidistant √force.

    A path ends when the force stops increasing, because a flat disc is smaller than a nearly flat balloon.
    """
    from scipy.interpolate import PchipInterpolator

    force = 1e-3 * np.pi * paths.pressure_kpa * paths.contact_radius_mm**2
    values = np.stack([paths.pressure_kpa, paths.half_height_mm], axis=2)
    highest, table = np.empty(ROWS), np.empty((ROWS, COLUMNS, 2))
    for row in range(ROWS):
        ends = (force[row, 1:] >= MAX_PUSH_N) | ~(np.diff(force[row, :], append=np.nan)[1:] > 0)
        nodes = int(np.argmax(ends)) + 2
        highest[row] = min(force[row, nodes - 1], MAX_PUSH_N)
        root = np.sqrt(highest[row]) * np.linspace(0, 1, COLUMNS)
        table[row] = PchipInterpolator(np.sqrt(force[row, :nodes]), values[row, :nodes])(root)
    return MembraneTable(gas, highest, table[..., 0], table[..., 1])
