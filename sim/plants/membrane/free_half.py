"""Half of a balloon that nothing touches: pressure, radius, height and volume by the stretch at its pole."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from pneuforce.sim.plants.membrane.material import MAX_STRETCH, Material, Skin
from pneuforce.sim.plants.membrane.shooting import EQUATOR, Array, Point, integrate, simpson_weights

POINTS = 30_001
#: Largest pole stretch of an uneven balloon, number of computed shapes, and number of steps of each shape.
MAX_UNEVEN_STRETCH, UNEVEN_SHAPES, STEPS = 1.8, 60, 80
#: Largest relative change of the pressure in one step of the secant method.
MAX_CHANGE = 0.05
SLOPE_TOLERANCE, MAX_SHOTS = 1e-9, 15


@dataclass(frozen=True, slots=True, eq=False)
class FreeHalf:
    """Table of the free half of a balloon, in the order of increasing pole stretch.

    Both halves of the balloon are mirror images. Therefore, the skin of a half is vertical at the equator.
    """

    stretch: Array  #: stretch at the pole
    pressure_kpa: Array
    radius_mm: Array  #: radius at the equator, which a caliper measures
    height_mm: Array  #: distance from the equator to the pole
    volume_mm3: Array
    limit: int  #: index of the limit point, or the last index if the pressure always rises

    @property
    def limit_stretch(self) -> float:
        """Return the stretch at the limit point, or the last stretch if the pressure always rises."""
        return float(self.stretch[self.limit])

    @property
    def limit_kpa(self) -> float:
        """Return the highest pressure [kPa] of the free balloon up to its limit point."""
        return float(self.pressure_kpa[self.limit])

    def stretch_at(self, pressure_kpa: Any) -> Any:
        """Return the stretch at a pressure [kPa], up to the limit point; 1 without pressure."""
        rising = slice(self.limit + 1)
        return np.interp(pressure_kpa, self.pressure_kpa[rising], self.stretch[rising])

    def pressure_at(self, stretch: Any) -> Any:
        """Return the pressure [kPa] at a pole stretch."""
        return np.interp(stretch, self.stretch, self.pressure_kpa)

    def radius_at(self, stretch: Any) -> Any:
        """Return the radius [mm] at the equator at a pole stretch."""
        return np.interp(stretch, self.stretch, self.radius_mm)

    def height_at(self, stretch: Any) -> Any:
        """Return the distance [mm] from the equator to the pole at a pole stretch."""
        return np.interp(stretch, self.stretch, self.height_mm)

    def volume_at(self, stretch: Any) -> Any:
        """Return the volume [mm³] at a pole stretch."""
        return np.interp(stretch, self.stretch, self.volume_mm3)


@lru_cache(maxsize=16)
def free_half(skin: Skin) -> FreeHalf:
    """Return the free half of a balloon. Without unevenness, the free half is a half sphere."""
    stretch = np.linspace(1.0, MAX_UNEVEN_STRETCH if skin.unevenness else MAX_STRETCH, POINTS)
    values = _uneven(skin, stretch) if skin.unevenness else _sphere(skin.material, stretch)
    finite = int(np.argmin(np.append(np.isfinite(values).all(axis=0), False)))  # a locked rubber gives NaN
    stretch, values = stretch[:finite], values[:, :finite]
    falling = np.flatnonzero(~(np.diff(values[0]) > 0))
    pressure, radius, height, volume = values
    limit = int(falling[0]) if falling.size else finite - 1
    return FreeHalf(stretch, pressure, radius, height, volume, limit)


def _sphere(material: Material, stretch: Array) -> Array:
    """Return pressure, radius, height and volume of half spheres. Laplace: ΔP = 2T/r."""
    radius = material.radius_mm * stretch
    pressure = 2 * material.tensions(stretch, stretch).along / radius
    return np.stack([pressure, radius, radius, 2 / 3 * np.pi * radius**3])


def _uneven(skin: Skin, stretch: Array) -> Array:
    """Return pressure, radius, height and volume of uneven halves, interpolated between computed shapes.

    The interpolated values are relative to the values of a sphere, because these ratios change slowly. At
    rest, the shape is a sphere. There, the pressure is in proportion to the thickness at the pole.
    """
    from scipy.interpolate import CubicSpline

    poles = np.linspace(stretch[0], stretch[-1], UNEVEN_SHAPES + 1)[1:]
    with np.errstate(all="ignore"):
        pressure = _solve_pressure(skin, poles)
        shapes = np.stack([pressure, *_shapes(skin, poles, pressure)])
    ratios = shapes / _sphere(skin.material, poles)
    found = np.isfinite(ratios).all(axis=0)
    rest = [[skin.thickness(1.0)], [1.0], [1.0], [1.0]]
    known = np.hstack([rest, ratios[:, found]])
    interpolated: Array = CubicSpline(np.append(1.0, poles[found]), known, axis=1)(stretch)
    return interpolated * _sphere(skin.material, stretch)


def _solve_pressure(skin: Skin, poles: Array) -> Array:
    """Return the pressures [kPa] at which the skin is vertical at the equator, by the secant method.

    The pressure is NaN if no solution is found, which happens close to the state at rest.
    """
    before = _sphere(skin.material, poles)[0] * skin.thickness(1.0)
    pressure, miss_before = 1.001 * before, _miss(skin, poles, before)
    for _ in range(MAX_SHOTS):
        miss = _miss(skin, poles, pressure)
        if not (abs(miss) > SLOPE_TOLERANCE).any():
            break
        slope = (miss - miss_before) / np.where(pressure == before, np.inf, pressure - before)
        change = np.clip(miss / slope, -MAX_CHANGE * pressure, MAX_CHANGE * pressure)
        before, miss_before = pressure, miss
        pressure = pressure - np.where(abs(miss) > SLOPE_TOLERANCE, change, 0.0)
    return np.where(abs(miss) <= SLOPE_TOLERANCE, pressure, np.nan)


def _miss(skin: Skin, poles: Array, pressure_kpa: Array) -> Array:
    slope: Array = _points(skin, poles, pressure_kpa)[-1].slope - EQUATOR
    return slope


def _shapes(skin: Skin, poles: Array, pressure_kpa: Array) -> Array:
    """Return radius, height and volume of the shapes."""
    points = _points(skin, poles, pressure_kpa)
    r, along, slope = (np.stack(nodes) for nodes in zip(*points, strict=True))
    depth_rate = skin.material.radius_mm * along * np.sin(slope)
    weights = simpson_weights(STEPS) * EQUATOR
    return np.stack([r[-1], weights @ depth_rate, weights @ (np.pi * r * r * depth_rate)])


def _points(skin: Skin, poles: Array, pressure_kpa: Array) -> list[Point]:
    angles = np.linspace(0, EQUATOR, STEPS + 1)[:, None] + 0.0 * poles
    return integrate(skin, angles, Point(0.0 * poles, poles, 0.0 * poles), pressure_kpa)
