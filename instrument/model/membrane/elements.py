"""Finite elements of a pressed half balloon: elastic energy and gas volume, with their derivatives.

The meridian from the pole to the equator is divided into straight elements (frustums of cones). Node n has
the radius r and the height z above the plane of the equator. The unknowns are ordered r0, z0, r1, z1, …
All arrays have one row for each balloon, so that many balloons are computed together.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pneuforce.instrument.model.rubber import Floats, RubberSkin

#: Number of diagonals of the stiffness matrix above and below the main diagonal.
BANDWIDTH = 3
#: Second derivative of the squared length of an element with respect to r and z of its two nodes, halved.
_LENGTH = np.array([[1, 0, -1, 0], [0, 1, 0, -1], [-1, 0, 1, 0], [0, -1, 0, 1]], float)


class Assembled(NamedTuple):
    """Quantities of several half balloons with a given shape and pressure."""

    energy_gradient: Floats  #: elastic force on each unknown [mN], (balloons, unknowns)
    volume_gradient: Floats  #: derivative of the gas volume [mm²], (balloons, unknowns)
    stiffness: Floats  #: bands of the second derivative of energy − p·volume, (7, balloons, unknowns)
    volume_mm3: Floats  #: gas volume of the half balloon, (balloons,)


@dataclass(frozen=True, slots=True)
class HalfBalloon:
    """Mesh of the skin of half a balloon at rest. Each field of `skin` has the shape (balloons,)."""

    skin: RubberSkin
    elements: int

    @property
    def rest_angle(self) -> Floats:
        """Return the angle of each node on the sphere at rest, from 0 at the pole to π/2 at the equator."""
        return np.linspace(0, np.pi / 2, self.elements + 1)

    def assemble(self, r: Floats, z: Floats, pressure_kpa: Floats) -> Assembled:
        """Return energy gradient, volume and stiffness of shapes (balloons, nodes) at their pressures."""
        rest_mm = np.asarray(self.skin.rest_radius_mm)[:, None]
        angle = self.rest_angle
        rest_length = rest_mm * np.diff(angle)
        rest_ring = rest_mm * np.sin((angle[1:] + angle[:-1]) / 2)
        area = 2 * np.pi * rest_ring * rest_length
        dr, dz = np.diff(r, axis=1), np.diff(z, axis=1)
        length = np.hypot(dr, dz)
        along, around = length / rest_length, (r[:, 1:] + r[:, :-1]) / (2 * rest_ring)
        column = RubberSkin(*(np.asarray(v)[:, None] for v in _fields(self.skin)))
        (w1, w2), (w11, w22, w12) = column.energy_derivatives(along, around)
        direction = np.stack([-dr, -dz, dr, dz]) / length  # derivative of the length
        by_along = direction / rest_length
        half = 0.5 / rest_ring
        by_around = np.stack([half, 0 * half, half, 0 * half])
        gradient = (w1 * by_along + w2 * by_around) * area
        curvature = w1 / (length * rest_length)
        ring_volume, ring_gradient, ring_second = _frustum(r, dz)
        bands = np.zeros((2 * BANDWIDTH + 1, *r.shape[:1], 2 * r.shape[1]))
        for i in range(4):
            for j in range(4):
                second = w11 * by_along[i] * by_along[j] + w22 * by_around[i] * by_around[j]
                second += w12 * (by_along[i] * by_around[j] + by_around[i] * by_along[j])
                second += curvature * (_LENGTH[i, j] - direction[i] * direction[j])
                entry = second * area - pressure_kpa[:, None] * ring_second[i][j]
                bands[BANDWIDTH + i - j, :, j : j + 2 * self.elements : 2] += entry
        return Assembled(_summed(gradient), _summed(ring_gradient), bands, ring_volume.sum(axis=1))


def _fields(skin: RubberSkin) -> tuple[Floats, Floats, Floats]:
    return skin.rest_radius_mm, skin.c1_kpa_mm, skin.c2_kpa_mm


def _frustum(r: Floats, dz: Floats) -> tuple[Floats, Floats, list[list[Floats]]]:
    """Return volume, gradient and second derivatives of each frustum V = π/3 (−dz)(r_a² + r_a r_b + r_b²)."""
    a, b, h, zero = r[:, :-1], r[:, 1:], -dz, 0 * dz
    third = np.pi / 3
    squares = third * (a * a + a * b + b * b)
    by_a, by_b = third * (2 * a + b), third * (2 * b + a)
    second = [
        [2 * third * h, by_a, third * h, -by_a],
        [by_a, zero, by_b, zero],
        [third * h, by_b, 2 * third * h, -by_b],
        [-by_a, zero, -by_b, zero],
    ]
    return squares * h, np.stack([h * by_a, squares, h * by_b, -squares]), second


def _summed(by_element: Floats) -> Floats:
    """Return the sum over the elements for each unknown. `by_element` is (4, balloons, elements)."""
    _, balloons, elements = by_element.shape
    total = np.zeros((balloons, elements + 1, 2))
    total[:, :-1] += np.moveaxis(by_element[:2], 0, -1)
    total[:, 1:] += np.moveaxis(by_element[2:], 0, -1)
    return total.reshape(balloons, -1)
