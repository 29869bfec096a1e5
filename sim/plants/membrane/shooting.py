"""Shape of the pressed balloon by the shooting method, from the edge of the contact to the equator.

The meridian lies flat on the plate, is free beyond the edge of the plate, and is vertical at the equator.
The independent variable is the angle φ of a point on the half sphere at rest: λ1 = ds/(R₀ dφ),
λ2 = r/(R₀ sin φ), θ is the slope. Equilibrium requires d(r T1)/ds = T2 cos θ everywhere and
κ1 T1 + κ2 T2 = ΔP on the free part. On the plate, which is frictionless here, θ = 0.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from pneuforce.sim.plants.membrane.material import Skin

Array = npt.NDArray[np.float64]

FLAT_STEPS, FREE_STEPS = 12, 40
EQUATOR = np.pi / 2
#: Largest slope θ [rad] up to which a meridian is integrated. With a larger slope, the skin cannot be
#: vertical at the equator, and the radius would become negative.
MAX_SLOPE = 2.2


class Point(NamedTuple):
    """Point on the meridian of each shape: radius r [mm], stretch λ1, slope θ."""

    r_mm: Any
    along: Any
    slope: Any

    def moved(self, rates: Point, by: Any) -> Point:
        """Return the point after a step `by` with these derivatives."""
        return Point(*(value + by * rate for value, rate in zip(self, rates, strict=True)))


class FreePart(NamedTuple):
    """Part of the pressed half that is not on the plate, for each shape."""

    equator: Point
    height_mm: Array  #: distance from the plate to the equator
    volume_mm3: Array  #: volume between the plate and the equator


def frictionless_edge(skin: Skin, pole_stretch: Array, contact_angle: Array) -> Point:
    """Return the edge of a contact without friction, for each stretch at the pole and contact angle φ."""
    angles = contact_angle * _column(FLAT_STEPS, pole_stretch)
    pole = Point(0.0 * pole_stretch, pole_stretch, 0.0 * pole_stretch)
    return integrate(skin, angles, pole, None)[-1]


def free_part(skin: Skin, edge: Point, contact_angle: Any, pressure_kpa: Array) -> FreePart:
    """Return the free part beyond the edge of a contact at the angle φ > 0."""
    # Near a small contact, the slope changes within the length a. Therefore the steps increase with φ.
    ratio = EQUATOR / contact_angle
    angles = contact_angle * ratio ** _column(FREE_STEPS, pressure_kpa)
    points = integrate(skin, angles, edge, pressure_kpa)
    r, along, slope = (np.stack(nodes) for nodes in zip(*points, strict=True))
    # The nodes are equidistant in ln φ, so that Simpson's rule needs the derivatives with respect to ln φ.
    depth_rate = skin.material.radius_mm * along * np.sin(slope) * angles
    weights = simpson_weights(FREE_STEPS) * np.log(ratio)
    height, volume = (np.tensordot(weights, rate, 1) for rate in (depth_rate, np.pi * r * r * depth_rate))
    return FreePart(points[-1], height, volume)


def _column(steps: int, shapes: Array) -> Array:
    """Return equidistant numbers from 0 to 1 along a new first axis, for an array of shapes."""
    return np.linspace(0, 1, steps + 1).reshape(-1, *(1,) * np.ndim(shapes))


def simpson_weights(steps: int) -> Array:
    """Return the weights of Simpson's rule on the unit interval, for an even number of steps."""
    weights = np.ones(steps + 1)
    weights[1:-1:2], weights[2:-1:2] = 4.0, 2.0
    return weights / (3 * steps)


def slack_limit(skin: Skin, contact_angle: Array) -> tuple[Array, Array]:
    """Return the pole stretch and the radius a [mm] at which the meridian tension at the edge is zero.

    No shape without friction exists below this stretch. The stretch is less than 1, because the rim of a flat
    disc is wider than the same ring on the sphere.
    """
    poles = np.linspace(0.9, 1.02, 241)[:, None] + 0.0 * contact_angle
    edge = frictionless_edge(skin, poles, contact_angle)
    tension = edge_tension(skin, edge, contact_angle)
    found = np.array(
        [
            [np.interp(0.0, tensions, poles[:, 0]), np.interp(0.0, tensions, radii)]
            for tensions, radii in zip(tension.T, edge.r_mm.T, strict=True)
        ]
    )
    return found[:, 0], found[:, 1]


def edge_tension(skin: Skin, edge: Point, contact_angle: Any) -> Array:
    """Return the tension T1 [kPa·mm] along the meridian at the edge of the contact."""
    around = edge.r_mm / (skin.material.radius_mm * np.sin(contact_angle))
    tension: Array = skin.thickness(np.cos(contact_angle)) * skin.material.tensions(edge.along, around).along
    return tension


def integrate(skin: Skin, angles: Array, point: Point, pressure_kpa: Array | None) -> list[Point]:
    """Return the points at all angles, integrated by the classical Runge–Kutta method.

    If `pressure_kpa` is None, the points lie on the plate.
    """
    points = [point]
    for start, end in pairwise(angles):
        step, middle = end - start, (start + end) / 2
        k1 = _rates(skin, start, point, pressure_kpa)
        k2 = _rates(skin, middle, point.moved(k1, step / 2), pressure_kpa)
        k3 = _rates(skin, middle, point.moved(k2, step / 2), pressure_kpa)
        k4 = _rates(skin, end, point.moved(k3, step), pressure_kpa)
        weight = step * (point.slope < MAX_SLOPE) / 6
        mean = Point(*(a + 2 * (b + c) + d for a, b, c, d in zip(k1, k2, k3, k4, strict=True)))
        point = point.moved(mean, weight)
        points.append(point)
    return points


def _rates(skin: Skin, angle: Array, point: Point, pressure_kpa: Array | None) -> Point:
    """Return the derivatives of a point with respect to φ."""
    r, along, slope = point
    material = skin.material
    arc = material.radius_mm * along
    sine, cosine = np.sin(angle), np.cos(angle)
    thickness = skin.thickness(cosine)
    if not sine.any():  # the pole, where both stretches and both curvatures are equal, and λ1 is even in φ
        if pressure_kpa is None:
            return Point(arc, 0.0 * arc, 0.0 * arc)
        tension = thickness * material.tensions(along, along).along
        return Point(arc, 0.0 * arc, arc * pressure_kpa / (2 * tension))
    around = r / (material.radius_mm * sine)
    tensions = material.tensions(along, around)
    level = 1.0 if pressure_kpa is None else np.cos(slope)
    widening = (along * level - around * cosine) / sine  # dλ2/dφ
    # T1 is the tension of a skin with the thickness h₀, times the thickness ratio.
    thinning = tensions.along * skin.unevenness * sine / thickness
    pull = (tensions.around - tensions.along) * level * arc / r + thinning
    slope_rate = (
        0.0 * arc
        if pressure_kpa is None
        else arc * (pressure_kpa / thickness - np.sin(slope) / r * tensions.around) / tensions.along
    )
    return Point(
        arc * level, (pull - tensions.along_by_around * widening) / tensions.along_by_along, slope_rate
    )
