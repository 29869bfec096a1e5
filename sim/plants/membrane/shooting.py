"""Shape of the pressed balloon by the shooting method, from the pole to the equator.

The meridian lies flat on the plate, is free beyond the edge of the plate, and is vertical at the equator.
The independent variable is the angle φ of a point on the half sphere at rest: λ1 = ds/(R₀ dφ),
λ2 = r/(R₀ sin φ), θ is the slope. Equilibrium requires d(r T1)/ds = T2 cos θ everywhere and
κ1 T1 + κ2 T2 = ΔP on the free part. On the plate, which is frictionless, θ = 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from pneuforce.sim.plants.membrane.material import Material

Array = npt.NDArray[np.float64]

FLAT_STEPS, FREE_STEPS = 24, 80
EQUATOR = np.pi / 2
#: Largest slope θ [rad] up to which a meridian is integrated. With a larger slope, the skin cannot be
#: vertical at the equator, and the radius would become negative.
MAX_SLOPE = 2.2
SLOPE_TOLERANCE, MAX_SHOTS = 1e-9, 30


class _Point(NamedTuple):
    """Point on the meridian of each shape: radius r [mm], stretch λ1, slope θ."""

    r_mm: Any
    along: Any
    slope: Any

    def moved(self, rates: _Point, by: Any) -> _Point:
        return _Point(*(value + by * rate for value, rate in zip(self, rates, strict=True)))


@dataclass(frozen=True, slots=True)
class Shapes:
    """Pressed half balloons in equilibrium, one per column. Rows are nodes from the pole to the equator."""

    material: Material
    pressure_kpa: Array
    contact_radius_mm: Array  #: radius a of the edge of the contact
    angle: Array  #: angle φ of the nodes
    r_mm: Array
    along: Array  #: stretch λ1 along the meridian
    slope: Array  #: slope θ, zero on the plate

    @property
    def force_n(self) -> Array:
        """Return F = ΔP π a² [N]. The skin leaves the plate with zero slope, so its tension adds no force."""
        force: Array = 1e-3 * np.pi * self.pressure_kpa * self.contact_radius_mm**2
        return force

    @property
    def around(self) -> Array:
        """Return the stretch λ2 around the axis at the nodes. At the pole, λ2 = λ1."""
        sine = self.material.radius_mm * np.sin(self.angle)
        return np.divide(self.r_mm, sine, out=self.along.copy(), where=sine > 0)

    @property
    def height_mm(self) -> Array:
        """Return the distance from the plate to each node [mm]."""
        return _cumulative_integral(self.material.radius_mm * self.along * np.sin(self.slope), self.angle)

    @property
    def half_height_mm(self) -> Array:
        """Return the distance from the plate to the equator [mm]."""
        height: Array = self.height_mm[-1]
        return height

    @property
    def half_volume_mm3(self) -> Array:
        """Return the volume between the plate and the equator [mm³]."""
        depth_rate = self.material.radius_mm * self.along * np.sin(self.slope)
        volume: Array = _cumulative_integral(np.pi * self.r_mm**2 * depth_rate, self.angle)[-1]
        return volume


def press(material: Material, pole_stretch: Array, contact_angle: Array) -> Shapes:
    """Return the shapes with these stretches at the pole and these contact angles φ, 0 < φ < π/2.

    A shape that does not exist is NaN, for example if the skin would be compressed at the edge of the plate.
    """
    pole_stretch, contact_angle = np.broadcast_arrays(pole_stretch, contact_angle)
    with np.errstate(all="ignore"):
        flat_angles = contact_angle * np.linspace(0, 1, FLAT_STEPS + 1)[:, None]
        pole = _Point(0.0 * pole_stretch, pole_stretch + 0.0, 0.0 * pole_stretch)
        flat = _integrate(material, flat_angles, pole, None)
        # Near a small contact, the slope changes within the length a. Therefore the steps increase with φ.
        free_angles = contact_angle * (EQUATOR / contact_angle) ** np.linspace(0, 1, FREE_STEPS + 1)[:, None]
        pressure = _solve_pressure(material, free_angles, flat[-1])
        free = _integrate(material, free_angles, flat[-1], pressure)
    r, along, slope = (np.stack(nodes) for nodes in zip(*flat, *free[1:], strict=True))
    angle = np.concatenate([flat_angles, free_angles[1:]])
    return Shapes(material, pressure, flat[-1].r_mm, angle, r, along, slope)


def slack_limit(material: Material, contact_angle: Array) -> tuple[Array, Array]:
    """Return the pole stretch and the radius a [mm] at which the meridian tension at the edge is zero.

    No shape exists below this stretch. The stretch is less than 1, because the rim of a flat disc is wider
    than the same ring on the sphere.
    """
    poles = np.linspace(0.9, 1.02, 241)[:, None]
    angles = contact_angle * np.linspace(0, 1, FLAT_STEPS + 1)[:, None, None]
    edge = _integrate(material, angles, _Point(0.0 * poles, poles, 0.0 * poles), None)[-1]
    tension = material.tensions(edge.along, edge.r_mm / (material.radius_mm * np.sin(contact_angle))).along
    found = np.array(
        [
            [np.interp(0.0, tensions, poles[:, 0]), np.interp(0.0, tensions, radii)]
            for tensions, radii in zip(tension.T, edge.r_mm.T, strict=True)
        ]
    )
    return found[:, 0], found[:, 1]


def _solve_pressure(material: Material, angles: Array, edge: _Point) -> Array:
    """Return the pressures [kPa] at which the skin is vertical at the equator, by a bracketed secant method.

    The slope at the equator increases with the pressure, up to the first solution.
    """
    tension = material.tensions(edge.along, edge.r_mm / (material.radius_mm * np.sin(angles[0]))).along
    left = 1 - angles[0] / EQUATOR
    pressure = np.where(tension > 0, tension * (1 + left) / (material.radius_mm * edge.along * left), np.nan)
    low, high = 0.0 * pressure, np.full_like(pressure, np.inf)
    before, miss_before, miss = low, low - EQUATOR, low + np.inf
    for _ in range(MAX_SHOTS):
        unsolved = abs(miss) > SLOPE_TOLERANCE
        if not unsolved.any():
            break
        starts = _Point(*(values[unsolved] for values in edge))
        miss = miss.copy()
        miss[unsolved] = (
            _integrate(material, angles[:, unsolved], starts, pressure[unsolved])[-1].slope - EQUATOR
        )
        low, high = np.where(miss < 0, pressure, low), np.where(miss < 0, high, pressure)
        secant = pressure - miss * (pressure - before) / (miss - miss_before)
        middle = np.where(np.isinf(high), 2 * pressure, (low + high) / 2)
        better = np.where((secant > low) & (secant < high), secant, middle)
        before, miss_before = pressure, miss
        pressure = np.where(abs(miss) > SLOPE_TOLERANCE, better, pressure)
    return np.where(abs(miss) <= SLOPE_TOLERANCE, pressure, np.nan)


def _integrate(material: Material, angles: Array, point: _Point, pressure_kpa: Array | None) -> list[_Point]:
    """Return the points at all angles, integrated by the classical Runge–Kutta method.

    If `pressure_kpa` is None, the points lie on the plate.
    """
    points = [point]
    for start, end in pairwise(angles):
        step, middle = end - start, (start + end) / 2
        k1 = _rates(material, start, point, pressure_kpa)
        k2 = _rates(material, middle, point.moved(k1, step / 2), pressure_kpa)
        k3 = _rates(material, middle, point.moved(k2, step / 2), pressure_kpa)
        k4 = _rates(material, end, point.moved(k3, step), pressure_kpa)
        weight = step * (point.slope < MAX_SLOPE) / 6
        mean = _Point(*(a + 2 * (b + c) + d for a, b, c, d in zip(k1, k2, k3, k4, strict=True)))
        point = point.moved(mean, weight)
        points.append(point)
    return points


def _rates(material: Material, angle: Array, point: _Point, pressure_kpa: Array | None) -> _Point:
    """Return the derivatives of a point with respect to φ."""
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
    slope_rate = (
        0.0 * arc
        if pressure_kpa is None
        else arc * (pressure_kpa - np.sin(slope) / r * tensions.around) / tensions.along
    )
    return _Point(
        arc * level, (pull - tensions.along_by_around * widening) / tensions.along_by_along, slope_rate
    )


def _cumulative_integral(rate: Array, angle: Array) -> Array:
    """Return ∫ rate dφ from the pole to each node, by Simpson's rule for unequal steps."""
    from scipy.integrate import cumulative_simpson

    total: Array = cumulative_simpson(rate, x=angle, axis=0, initial=0)
    return total
