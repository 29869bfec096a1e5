"""Presses of one balloon for studies: force, pressure and geometry at several ΔP_i, without a table."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from pneuforce.sim.plants.membrane.free_half import free_half
from pneuforce.sim.plants.membrane.material import Skin
from pneuforce.sim.plants.membrane.paths import SMALL_CONTACTS, PressedBalloon, press_nodes
from pneuforce.sim.plants.membrane.shooting import Array

FRACTIONS = np.concatenate([SMALL_CONTACTS, np.linspace(0.1, 0.98, 32)])


class PressPath(NamedTuple):
    """Presses of one balloon. Each column of the arrays is the press that begins at one ΔP_i.

    The first row is the free balloon, and the last row is the completely flat balloon. Shapes that do not
    exist are NaN.
    """

    force_n: Array
    final_kpa: Array  #: ΔP_f, gauge pressure during the contact
    contact_radius_mm: Array
    indentation_mm: Array

    def at(self, force_n: npt.ArrayLike) -> PressPath:
        """Return the presses at these forces [N], one force per row.

        The values between two shapes are interpolated by cubic splines over √force. The values are NaN for
        negative forces, and beyond the first maximum of the force.
        """
        from scipy.interpolate import CubicSpline

        forces = np.asarray(force_n, dtype=float)
        values = np.stack(self[1:])
        found = np.full((3, forces.size, self.force_n.shape[1]), np.nan)
        for column, path in enumerate(self.force_n.T):
            nodes = int(np.argmax(~(np.diff(path, append=np.nan) > 0))) + 1
            if nodes > 1:
                known = CubicSpline(np.sqrt(path[:nodes]), values[:, :nodes, column], axis=1)
                inside = (forces >= 0) & (forces <= path[nodes - 1])
                found[:, inside, column] = known(np.sqrt(forces[inside]))
        return PressPath(forces[:, None] + 0.0 * found[0], *found)


def press_path(
    balloon: PressedBalloon, baseline_kpa: npt.ArrayLike, fractions: Array = FRACTIONS
) -> PressPath:
    """Return the presses that begin at each of the pressures ΔP_i `baseline_kpa`.

    `fractions` are the computed parts of the half meridian that lie on the plate, in increasing order. A
    pressure that the free balloon does not reach, because of its limit point, gives NaN. If ΔP_f exceeds
    `limit_kpa` and the balloon has one side, the free half keeps its volume, which is an approximation.
    """
    baselines = np.asarray(baseline_kpa, dtype=float)
    free = free_half(balloon.skin)
    reached = (baselines > 0) & (baselines < free.limit_kpa)
    stretch = np.where(reached, free.stretch_at(baselines), np.nan)
    nodes = list(press_nodes(balloon, stretch, fractions))
    pressure, radius, height = (
        np.stack([getattr(node, name) for node in nodes])
        for name in ("pressure_kpa", "contact_radius_mm", "half_height_mm")
    )
    return PressPath(1e-3 * np.pi * pressure * radius**2, pressure, radius, height[0] - height)


def free_radius_mm(skin: Skin, pressure_kpa: npt.ArrayLike) -> Array:
    """Return R_i [mm] of the free balloon at these pressures: the radius at the equator, as with a caliper.

    The radius is NaN for pressures that the balloon does not reach.
    """
    pressures, free = np.asarray(pressure_kpa, dtype=float), free_half(skin)
    radius: Array = free.radius_at(free.stretch_at(pressures))
    return np.where((pressures >= 0) & (pressures <= free.limit_kpa), radius, np.nan)


def limit_kpa(skin: Skin) -> float:
    """Return the pressure [kPa] at the limit point of the free balloon.

    Without a limit point, return the pressure at the largest tabulated stretch, 4 (uneven skin: 1.8).
    """
    return free_half(skin).limit_kpa
