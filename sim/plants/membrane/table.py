"""Table of the membrane plant: pressure and height by amount of gas and force, in the reference circuit.

The rows are equidistant in the amount of gas. The columns are equidistant in √(force / highest force of the
row), because the contact radius is proportional to √force at small forces.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pneuforce.sim.plants.membrane.free_half import free_half
from pneuforce.sim.plants.membrane.material import Rubber, Skin
from pneuforce.sim.plants.membrane.paths import SMALL_CONTACTS, Contact, PressedBalloon, Sides, press_nodes
from pneuforce.sim.plants.membrane.shooting import Array
from pneuforce.sim.plants.plant import AMBIENT_KPA, MAX_PUSH_N, TUBES_MM3

ROWS, COLUMNS = 400, 160
MIN_FREE_KPA, MAX_FREE_STRETCH = 0.05, 1.85
#: Largest stretch without contact at which a pressed skin may wrinkle, so that its shapes are scaled.
MAX_WRINKLED_STRETCH = 1.1
#: Contact fractions of the computed shapes.
FRACTIONS = np.concatenate([SMALL_CONTACTS, np.linspace(0.1, 0.96, 44), [0.97, 0.98]])
NODES = FRACTIONS.size + 2  #: nodes of a path; the first node is the free balloon, and the last node is flat
FINE_POINTS = 20_001

#: Callback that receives the number of finished steps and the total number of steps.
ProgressCallback = Callable[[int, int], None]


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

    @property
    def force_n(self) -> Array:
        force: Array = 1e-3 * np.pi * self.pressure_kpa * self.contact_radius_mm**2
        return force

    @property
    def last_nodes(self) -> npt.NDArray[np.int_]:
        """Return the index of the last node of each path.

        A path ends at `MAX_PUSH_N`, or when the force stops increasing, because a flat disc is smaller than
        a nearly flat balloon. A path also ends before a missing shape.
        """
        force = self.force_n
        ends = (force >= MAX_PUSH_N) | ~(np.diff(force, append=np.nan) > 0)
        last: npt.NDArray[np.int_] = np.argmax(ends, axis=1)
        return last

    @property
    def complete(self) -> npt.NDArray[np.bool_]:
        """Return True for the paths that do not end before a missing shape."""
        force, last = self.force_n, self.last_nodes[:, None]
        following = np.take_along_axis(force, np.minimum(last + 1, force.shape[1] - 1), axis=1)
        return np.isfinite(following[:, 0]) | (np.take_along_axis(force, last, axis=1)[:, 0] >= MAX_PUSH_N)


def compute_table(
    rubber: Rubber, sides: Sides, contact: Contact, progress: ProgressCallback = lambda _done, _total: None
) -> MembraneTable:
    """Return the table of a balloon that is pressed on one or two `sides`.

    `progress(done, total)` is called during the computation. Raises ArithmeticError if the shooting method
    does not find all shapes of the rubber.
    """
    balloon = PressedBalloon(Skin(rubber), sides, contact)
    gas, stretch = _rows(rubber)
    nodes: list[tuple[Array, Array, Array]] = []
    for node in press_nodes(balloon, stretch, FRACTIONS):
        nodes.append((node.pressure_kpa, node.half_height_mm, node.contact_radius_mm))
        progress(len(nodes), NODES)
    paths = _Paths(*np.stack(nodes, axis=2))
    # Beyond the limit point of the rubber, the force may have a maximum at which the path turns back.
    missing = ~paths.complete & ((stretch <= free_half(balloon.skin).limit_stretch) | (paths.last_nodes == 0))
    first = int(np.flatnonzero(missing).max(initial=-1)) + 1
    if not stretch[min(first, ROWS - 1)] <= MAX_WRINKLED_STRETCH:
        raise ArithmeticError(
            f"some pressed shapes of {rubber} were not found: use constants closer to the defaults"
        )
    return _resampled(gas, _extended(paths, gas, first))


def _rows(rubber: Rubber) -> tuple[Array, Array]:
    """Return the amount of gas and the stretch of the free balloon of each row."""
    stretch = np.linspace(1.0, MAX_FREE_STRETCH, FINE_POINTS)
    free_kpa = rubber.free_kpa(stretch)
    volume = 4 / 3 * np.pi * (rubber.radius_mm * stretch) ** 3
    free_gas = (free_kpa + AMBIENT_KPA) * (volume + TUBES_MM3)
    gas = np.linspace(free_gas[np.argmax(free_kpa > MIN_FREE_KPA)], free_gas[-1], ROWS)
    return gas, np.interp(gas, free_gas, stretch)


def _extended(paths: _Paths, gas: Array, first: int) -> _Paths:
    """Return the paths with shapes for the rows below `first`, in which shapes are missing.

    In these rows, the skin wrinkles and hardly stretches. The shapes are those of row `first`, scaled to the
    free radius of each row. The gas law gives the pressure.
    """
    scale = (paths.half_height_mm[:first, 0] / paths.half_height_mm[first, 0])[:, None]
    volume = (gas[first] / (paths.pressure_kpa[first] + AMBIENT_KPA) - TUBES_MM3) * scale**3
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
    """Return the table of the paths, interpolated at equidistant √force."""
    from scipy.interpolate import PchipInterpolator

    force, values = paths.force_n, np.stack([paths.pressure_kpa, paths.half_height_mm], axis=2)
    highest, table = np.empty(ROWS), np.empty((ROWS, COLUMNS, 2))
    for row, last in enumerate(paths.last_nodes):
        highest[row] = min(force[row, last], MAX_PUSH_N)
        root = np.sqrt(highest[row]) * np.linspace(0, 1, COLUMNS)
        path = slice(last + 1)
        table[row] = PchipInterpolator(np.sqrt(force[row, path]), values[row, path])(root)
    return MembraneTable(gas, highest, table[..., 0], table[..., 1])


def blend(slide: MembraneTable, stick: MembraneTable, grip: float) -> MembraneTable:
    """Return a table between a sliding (`grip` 0) and a sticking table (`grip` 1) of one balloon.

    At the same amount of gas and the same force, pressure and height are weighted means of both tables. The
    highest force of a row is the smaller one of both tables. This interpolation is not a law of friction.
    """
    from scipy.interpolate import CubicSpline

    highest = np.minimum(slide.highest_n, stick.highest_n)
    column = np.linspace(0, 1, COLUMNS)
    means = np.zeros((ROWS, COLUMNS, 2))
    for table, weight in ((slide, 1 - grip), (stick, grip)):
        values = np.stack([table.pressure_kpa, table.half_height_mm], axis=2)
        for row, share in enumerate(np.sqrt(highest / table.highest_n)):
            means[row] += weight * CubicSpline(column, values[row])(share * column)
    return MembraneTable(slide.gas_kpa_mm3, highest, means[..., 0], means[..., 1])
