"""Tests of the finite elements: gradients and stiffness against difference quotients, and the volume."""

import numpy as np
import pytest

from pneuforce.instrument.model.membrane.elements import BANDWIDTH, HalfBalloon
from pneuforce.instrument.model.rubber import RubberSkin

ELEMENTS = 12
SKINS = RubberSkin(np.array([7.5, 8.0]), np.array([26.0, 39.0]), np.array([10.0, 0.0]))
MESH = HalfBalloon(SKINS, ELEMENTS)
PRESSURE = np.array([8.0, 5.0])


@pytest.fixture
def shape():
    """Return r and z of two irregular half balloons."""
    generator = np.random.default_rng(1)
    radius = np.array([[8.2], [8.4]]) + generator.normal(0, 0.05, (2, ELEMENTS + 1))
    return radius * np.sin(MESH.rest_angle), radius * np.cos(MESH.rest_angle)


def moved(shape, unknown, step):
    r, z = shape[0].copy(), shape[1].copy()
    (r, z)[unknown % 2][:, unknown // 2] += step
    return r, z


@pytest.mark.parametrize("unknown", [0, 1, 7, 12, 2 * ELEMENTS, 2 * ELEMENTS + 1])
def test_the_stiffness_is_the_derivative_of_the_forces(shape, unknown):
    h = 1e-5
    forces = []
    for step in (h, -h):
        found = MESH.assemble(*moved(shape, unknown, step), PRESSURE)
        forces.append(found.energy_gradient - PRESSURE[:, None] * found.volume_gradient)
    expected = (forces[0] - forces[1]) / (2 * h)
    bands = MESH.assemble(*shape, PRESSURE).stiffness
    column = np.zeros_like(expected)
    for offset in range(-BANDWIDTH, BANDWIDTH + 1):
        if 0 <= unknown + offset < column.shape[1]:
            column[:, unknown + offset] = bands[BANDWIDTH + offset, :, unknown]
    assert column == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize("unknown", [2, 9])
def test_the_volume_gradient_is_the_derivative_of_the_volume(shape, unknown):
    h = 1e-5
    up, down = (MESH.assemble(*moved(shape, unknown, s), PRESSURE).volume_mm3 for s in (h, -h))
    gradient = MESH.assemble(*shape, PRESSURE).volume_gradient[:, unknown]
    assert gradient == pytest.approx((up - down) / (2 * h), rel=1e-6)


def test_a_half_sphere_has_its_volume():
    mesh = HalfBalloon(RubberSkin(np.array([7.5]), np.array([26.0]), np.array([10.0])), 200)
    r, z = 8.0 * np.sin(mesh.rest_angle)[None], 8.0 * np.cos(mesh.rest_angle)[None]
    assert mesh.assemble(r, z, np.array([8.0])).volume_mm3 == pytest.approx(2 / 3 * np.pi * 512, rel=1e-4)
