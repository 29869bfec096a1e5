"""The table from which the plant is read: pressure and height by gas and force, in the reference circuit.

Rows are gas, evenly. Columns are √(force / the row's highest force), evenly: contact radius and √force begin
together.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.membrane.family import Progress, columns, reference_gas, reference_volume
from sim.membrane.material import Rubber
from sim.membrane.shooting import EQUATOR, Array, slack
from sim.plant import AMBIENT_KPA, HARDEST_N, TUBES_MM3

ROWS, COLUMNS = 400, 160
LEAST_FREE_KPA, MOST_FREE_STRETCH = 0.05, 1.85
FINE = 20_001


@dataclass(frozen=True, slots=True)
class Table:
    """One balloon. In column 0 it is free; in the last one it lies flat, or is pressed with `HARDEST_N`."""

    gas_kpa_mm3: Array  #: (rows,)
    highest_n: Array  #: (rows,)
    pressure_kpa: Array  #: (rows, columns)
    half_height_mm: Array  #: from the plate to the equator (rows, columns)


@dataclass(frozen=True, slots=True)
class _Paths:
    """How balloons go from free to flat, (rows, nodes); NaN beyond the family's reach."""

    pressure_kpa: Array
    half_height_mm: Array
    contact_radius_mm: Array


def build(rubber: Rubber, sides: int, progress: Progress = lambda _done, _total: None) -> Table:
    """The table of a balloon pressed on one or two `sides`; `progress(done, total)` hears how far it is.

    Raises ArithmeticError for a rubber too odd for the shots to find all its shapes.
    """
    stretch = np.linspace(1.0, MOST_FREE_STRETCH, FINE)
    free_kpa = rubber.free_kpa(stretch)
    free_gas = reference_gas(free_kpa, 4 / 3 * np.pi * (rubber.radius_mm * stretch) ** 3)
    least = int(np.argmax(free_kpa > LEAST_FREE_KPA))
    gas = np.linspace(free_gas[least], free_gas[-1], ROWS)
    stretch = np.interp(gas, free_gas, stretch)
    free = np.stack([rubber.free_kpa(stretch), rubber.radius_mm * stretch, 0.0 * gas])
    found = columns(rubber, sides, progress)
    if any(column.gas_kpa_mm3[-1] < gas[-1] and column.highest_n < HARDEST_N for column in found):
        raise ArithmeticError(f"some pressed shapes of {rubber} were not found")
    nodes = np.stack([free, *(column.at(gas) for column in found), _flat(rubber, sides, gas)], axis=2)
    first = int(np.searchsorted(gas, max(column.gas_kpa_mm3[0] for column in found)))
    return _resampled(gas, _limp(_Paths(*nodes), gas, first))


def _flat(rubber: Rubber, sides: int, gas: Array) -> Array:
    """Pressure, half height and contact radius (3, rows) where the pressed side holds nothing any more.

    Its rim pulls no more, so its radius does not depend on the pressure.
    """
    pressure = np.linspace(-1.0, 400.0, FINE)
    held = 2 / 3 * np.pi * (rubber.radius_mm * rubber.free_stretch(pressure)) ** 3 * (2 - sides)
    flat_kpa = np.interp(gas, reference_gas(pressure, held), pressure)
    radius = slack(rubber, np.array([EQUATOR]))[1]
    return np.stack([flat_kpa, 0.0 * gas, radius + 0.0 * gas])


def _limp(paths: _Paths, gas: Array, first: int) -> _Paths:
    """The rows below `first` too, where the skin would have to push: it wrinkles, and hardly stretches.

    They take the shapes of row `first`, scaled to their own free radius; the gas law gives the pressure.
    """
    scale = (paths.half_height_mm[:first, 0] / paths.half_height_mm[first, 0])[:, None]
    volume = reference_volume(paths.pressure_kpa[first], gas[first]) * scale**3
    limp = _Paths(
        gas[:first, None] / (volume + TUBES_MM3) - AMBIENT_KPA,
        paths.half_height_mm[first] * scale,
        paths.contact_radius_mm[first] * scale,
    )
    return _Paths(
        np.concatenate([limp.pressure_kpa, paths.pressure_kpa[first:]]),
        np.concatenate([limp.half_height_mm, paths.half_height_mm[first:]]),
        np.concatenate([limp.contact_radius_mm, paths.contact_radius_mm[first:]]),
    )


def _resampled(gas: Array, paths: _Paths) -> Table:
    """The paths at even √force, as far as it rises: a flat disc is smaller than a nearly flat balloon."""
    from scipy.interpolate import PchipInterpolator

    force = 1e-3 * np.pi * paths.pressure_kpa * paths.contact_radius_mm**2
    values = np.stack([paths.pressure_kpa, paths.half_height_mm], axis=2)
    highest, table = np.empty(ROWS), np.empty((ROWS, COLUMNS, 2))
    for row in range(ROWS):
        ends = (force[row, 1:] >= HARDEST_N) | ~(np.diff(force[row, :], append=np.nan)[1:] > 0)
        nodes = int(np.argmax(ends)) + 2
        highest[row] = min(force[row, nodes - 1], HARDEST_N)
        root = np.sqrt(highest[row]) * np.linspace(0, 1, COLUMNS)
        table[row] = PchipInterpolator(np.sqrt(force[row, :nodes]), values[row, :nodes])(root)
    return Table(gas, highest, table[..., 0], table[..., 1])
