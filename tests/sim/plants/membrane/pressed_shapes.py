"""Shapes without friction with a given stretch at the pole, solved by a bracketed secant method."""

from dataclasses import dataclass

import numpy as np
from scipy.integrate import cumulative_simpson

from pneuforce.sim.plants.membrane.material import Skin
from pneuforce.sim.plants.membrane.shooting import EQUATOR, FLAT_STEPS, Point, integrate

FREE_STEPS = 80
SLOPE_TOLERANCE, MAX_SHOTS = 1e-9, 30


@dataclass(frozen=True)
class Shapes:
    """Pressed half balloons in equilibrium, one per column. Rows are nodes from the pole to the equator."""

    skin: Skin
    pressure_kpa: np.ndarray
    contact_radius_mm: np.ndarray
    angle: np.ndarray
    r_mm: np.ndarray
    along: np.ndarray
    slope: np.ndarray

    @property
    def force_n(self):
        return 1e-3 * np.pi * self.pressure_kpa * self.contact_radius_mm**2

    @property
    def around(self):
        """Return the stretch λ2 around the axis at the nodes. At the pole, λ2 = λ1."""
        sine = self.skin.material.radius_mm * np.sin(self.angle)
        return np.divide(self.r_mm, sine, out=self.along.copy(), where=sine > 0)

    @property
    def half_height_mm(self):
        return self._integral(np.ones_like(self.angle))

    @property
    def half_volume_mm3(self):
        return self._integral(np.pi * self.r_mm**2)

    def _integral(self, area):
        depth_rate = self.skin.material.radius_mm * self.along * np.sin(self.slope)
        return cumulative_simpson(area * depth_rate, x=self.angle, axis=0, initial=0)[-1]


def press(skin, pole_stretch, contact_angle):
    """Return the shapes with these stretches at the pole and these contact angles φ, 0 < φ < π/2.

    A shape that does not exist is NaN, for example if the skin would be compressed at the edge of the plate.
    """
    pole_stretch, contact_angle = np.broadcast_arrays(pole_stretch, contact_angle)
    with np.errstate(all="ignore"):
        flat_angles = contact_angle * np.linspace(0, 1, FLAT_STEPS + 1)[:, None]
        pole = Point(0.0 * pole_stretch, pole_stretch + 0.0, 0.0 * pole_stretch)
        flat = integrate(skin, flat_angles, pole, None)
        free_angles = contact_angle * (EQUATOR / contact_angle) ** np.linspace(0, 1, FREE_STEPS + 1)[:, None]
        pressure = _solve_pressure(skin, free_angles, flat[-1])
        free = integrate(skin, free_angles, flat[-1], pressure)
    r, along, slope = (np.stack(nodes) for nodes in zip(*flat, *free[1:], strict=True))
    return Shapes(
        skin, pressure, flat[-1].r_mm, np.concatenate([flat_angles, free_angles[1:]]), r, along, slope
    )


def _solve_pressure(skin, angles, edge):
    """Return the pressures [kPa] at which the skin is vertical at the equator, by a bracketed secant method.

    The slope at the equator increases with the pressure, up to the first solution.
    """
    material = skin.material
    tension = material.tensions(edge.along, edge.r_mm / (material.radius_mm * np.sin(angles[0]))).along
    left = 1 - angles[0] / EQUATOR
    pressure = np.where(tension > 0, tension * (1 + left) / (material.radius_mm * edge.along * left), np.nan)
    low, high = 0.0 * pressure, np.full_like(pressure, np.inf)
    before, miss_before, miss = low, low - EQUATOR, low + np.inf
    for _ in range(MAX_SHOTS):
        unsolved = abs(miss) > SLOPE_TOLERANCE
        if not unsolved.any():
            break
        starts = Point(*(values[unsolved] for values in edge))
        miss = miss.copy()
        miss[unsolved] = integrate(skin, angles[:, unsolved], starts, pressure[unsolved])[-1].slope - EQUATOR
        low, high = np.where(miss < 0, pressure, low), np.where(miss < 0, high, pressure)
        secant = pressure - miss * (pressure - before) / (miss - miss_before)
        middle = np.where(np.isinf(high), 2 * pressure, (low + high) / 2)
        better = np.where((secant > low) & (secant < high), secant, middle)
        before, miss_before = pressure, miss
        pressure = np.where(abs(miss) > SLOPE_TOLERANCE, better, pressure)
    return np.where(abs(miss) <= SLOPE_TOLERANCE, pressure, np.nan)
