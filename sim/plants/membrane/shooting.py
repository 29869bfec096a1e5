"""The pressed shape, by shooting from the pole: flat on the plate, then free, upright at the equator.

Over the angle φ that a point of the half sphere had at rest: λ1 = ds/(R₀ dφ), λ2 = r/(R₀ sin φ), θ the slope.
d(r T1)/ds = T2 cos θ everywhere, κ1 T1 + κ2 T2 = ΔP where free, θ = 0 on the plate, which does not rub.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sim.membrane.material import Material

Array = npt.NDArray[np.float64]

FLAT_STEPS, FREE_STEPS = 24, 80
EQUATOR = np.pi / 2
#: A slope [rad] beyond which a shot has missed for good; it rests there, where its radius is still positive.
MISSED = 2.2
FINEST_SLOPE, MOST_SHOTS = 1e-9, 30


class _Point(NamedTuple):
    """A point on each meridian: r [mm], λ1, θ."""

    r_mm: Any
    along: Any
    slope: Any

    def moved(self, rates: _Point, by: Any) -> _Point:
        return _Point(*(value + by * rate for value, rate in zip(self, rates, strict=True)))


@dataclass(frozen=True, slots=True)
class Shapes:
    """Pressed half balloons in equilibrium, one per column; their nodes run from the pole to the equator."""

    material: Material
    pressure_kpa: Array
    contact_radius_mm: Array  #: a, where the plate ends
    angle: Array  #: φ
    r_mm: Array
    along: Array  #: λ1
    slope: Array  #: θ, zero on the plate

    @property
    def force_n(self) -> Array:
        """F = ΔP π a² [N]: no slope at the edge, so the plate carries the pressure and nothing else."""
        force: Array = 1e-3 * np.pi * self.pressure_kpa * self.contact_radius_mm**2
        return force

    @property
    def around(self) -> Array:
        """λ2 at the nodes; at the pole it is λ1."""
        sine = self.material.radius_mm * np.sin(self.angle)
        return np.divide(self.r_mm, sine, out=self.along.copy(), where=sine > 0)

    @property
    def height_mm(self) -> Array:
        """From the plate down to each node [mm]."""
        return _integral(self.material.radius_mm * self.along * np.sin(self.slope), self.angle)

    @property
    def half_height_mm(self) -> Array:
        """From the plate to the equator [mm]."""
        height: Array = self.height_mm[-1]
        return height

    @property
    def half_volume_mm3(self) -> Array:
        """Between the plate and the equator [mm³]."""
        falling = self.material.radius_mm * self.along * np.sin(self.slope)
        volume: Array = _integral(np.pi * self.r_mm**2 * falling, self.angle)[-1]
        return volume


def press(material: Material, pole_stretch: Array, contact_angle: Array) -> Shapes:
    """The shapes with these stretches at the pole that lie on the plate up to these angles φ, 0 < φ < π/2.

    NaN where a shape does not exist, as where the skin would push at the plate's edge.
    """
    pole_stretch, contact_angle = np.broadcast_arrays(pole_stretch, contact_angle)
    with np.errstate(all="ignore"):
        flat_angles = contact_angle * np.linspace(0, 1, FLAT_STEPS + 1)[:, None]
        pole = _Point(0.0 * pole_stretch, pole_stretch + 0.0, 0.0 * pole_stretch)
        flat = _march(material, flat_angles, pole, None)
        # Beside a small contact the slope changes within a length a: the steps grow with φ.
        free_angles = contact_angle * (EQUATOR / contact_angle) ** np.linspace(0, 1, FREE_STEPS + 1)[:, None]
        pressure = _aim(material, free_angles, flat[-1])
        free = _march(material, free_angles, flat[-1], pressure)
    r, along, slope = (np.stack(nodes) for nodes in zip(*flat, *free[1:], strict=True))
    angle = np.concatenate([flat_angles, free_angles[1:]])
    return Shapes(material, pressure, flat[-1].r_mm, angle, r, along, slope)


def slack(material: Material, contact_angle: Array) -> tuple[Array, Array]:
    """Stretch at the pole, and radius a [mm], where the skin does not pull along the meridian at the edge.

    Below that stretch there is no shape. It is less than 1: a flat disc's rim is wider than on the sphere.
    """
    poles = np.linspace(0.9, 1.02, 241)[:, None]
    angles = contact_angle * np.linspace(0, 1, FLAT_STEPS + 1)[:, None, None]
    edge = _march(material, angles, _Point(0.0 * poles, poles, 0.0 * poles), None)[-1]
    tension = material.tensions(edge.along, edge.r_mm / (material.radius_mm * np.sin(contact_angle))).along
    found = np.array(
        [
            [np.interp(0.0, pulls, poles[:, 0]), np.interp(0.0, pulls, radii)]
            for pulls, radii in zip(tension.T, edge.r_mm.T, strict=True)
        ]
    )
    return found[:, 0], found[:, 1]


def _aim(material: Material, angles: Array, edge: _Point) -> Array:
    """Pressures [kPa] at which the skin is upright at the equator, by a secant kept inside a bracket.

    The slope at the equator rises with the pressure, up to the first hit.
    """
    tension = material.tensions(edge.along, edge.r_mm / (material.radius_mm * np.sin(angles[0]))).along
    left = 1 - angles[0] / EQUATOR
    pressure = np.where(tension > 0, tension * (1 + left) / (material.radius_mm * edge.along * left), np.nan)
    low, high = 0.0 * pressure, np.full_like(pressure, np.inf)
    before, miss_before, miss = low, low - EQUATOR, low + np.inf
    for _ in range(MOST_SHOTS):
        off = abs(miss) > FINEST_SLOPE
        if not off.any():
            break
        aimed = _Point(*(values[off] for values in edge))
        miss = miss.copy()
        miss[off] = _march(material, angles[:, off], aimed, pressure[off])[-1].slope - EQUATOR
        low, high = np.where(miss < 0, pressure, low), np.where(miss < 0, high, pressure)
        secant = pressure - miss * (pressure - before) / (miss - miss_before)
        middle = np.where(np.isinf(high), 2 * pressure, (low + high) / 2)
        better = np.where((secant > low) & (secant < high), secant, middle)
        before, miss_before = pressure, miss
        pressure = np.where(abs(miss) > FINEST_SLOPE, better, pressure)
    return np.where(abs(miss) <= FINEST_SLOPE, pressure, np.nan)


def _march(material: Material, angles: Array, point: _Point, pressure_kpa: Array | None) -> list[_Point]:
    """Points at all angles by the classical Runge–Kutta step; without a pressure: on the plate."""
    points = [point]
    for start, end in pairwise(angles):
        step, middle = end - start, (start + end) / 2
        k1 = _rates(material, start, point, pressure_kpa)
        k2 = _rates(material, middle, point.moved(k1, step / 2), pressure_kpa)
        k3 = _rates(material, middle, point.moved(k2, step / 2), pressure_kpa)
        k4 = _rates(material, end, point.moved(k3, step), pressure_kpa)
        going = step * (point.slope < MISSED) / 6
        mean = _Point(*(a + 2 * (b + c) + d for a, b, c, d in zip(k1, k2, k3, k4, strict=True)))
        point = point.moved(mean, going)
        points.append(point)
    return points


def _rates(material: Material, angle: Array, point: _Point, pressure_kpa: Array | None) -> _Point:
    """d/dφ of a point."""
    r, along, slope = point
    arc = material.radius_mm * along
    sine = np.sin(angle)
    if not sine.any():  # the pole, where both stretches are equal and even in φ
        return _Point(arc, 0.0 * arc, 0.0 * arc)
    around = r / (material.radius_mm * sine)
    tensions = material.tensions(along, around)
    level = 1.0 if pressure_kpa is None else np.cos(slope)
    widening = (along * level - around * np.cos(angle)) / sine  # dλ2/dφ
    pull = (tensions.around - tensions.along) * level * arc / r  # dT1/dφ
    turn = (
        0.0 * arc
        if pressure_kpa is None
        else arc * (pressure_kpa - np.sin(slope) / r * tensions.around) / tensions.along
    )
    return _Point(arc * level, (pull - tensions.along_by_around * widening) / tensions.along_by_along, turn)


def _integral(rate: Array, angle: Array) -> Array:
    """∫ rate dφ from the pole to each node, by parabolas on unequal steps."""
    from scipy.integrate import cumulative_simpson

    total: Array = cumulative_simpson(rate, x=angle, axis=0, initial=0)
    return total
