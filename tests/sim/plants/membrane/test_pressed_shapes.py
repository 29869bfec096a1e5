"""Tests of the shape of the pressed balloon against known results of mechanics."""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.integrate import simpson, trapezoid
from scipy.optimize import fsolve

from pneuforce.sim.plants.membrane.material import RUBBERS, Skin, Tensions
from pneuforce.sim.plants.membrane.shooting import EQUATOR, slack_limit
from tests.sim.plants.membrane.identified import energy_kpa_mm
from tests.sim.plants.membrane.pressed_shapes import press

CONTACT_FRACTIONS = np.array([0.02, 0.1, 0.3, 0.5, 0.7, 0.85, 0.95])
RUBBER_NAMES = ["mooney-rivlin", "ogden"]
each = pytest.mark.parametrize("rubber", [RUBBERS[name] for name in RUBBER_NAMES], ids=RUBBER_NAMES)


def shape(rubber, pole, share):
    return press(Skin(rubber), np.array([pole]), np.array([share * EQUATOR]))


@each
@pytest.mark.parametrize("beyond", [0.03, 0.1, 0.3])
def test_each_ring_carries_the_pressure_on_the_area_outside_the_plate(rubber, beyond):
    """The global balance is 2πr T1 sin θ = ΔP π (r² − a²). The shooting method uses local balances only."""
    angles = CONTACT_FRACTIONS * EQUATOR
    shapes = press(Skin(rubber), slack_limit(Skin(rubber), angles)[0] + beyond, angles)
    tension = rubber.tensions(shapes.along, shapes.around).along
    free = shapes.angle >= angles
    pulled = 2 * shapes.r_mm * tension * np.sin(shapes.slope)
    pushed = shapes.pressure_kpa * (shapes.r_mm**2 - shapes.contact_radius_mm**2)
    assert abs(np.where(free, pulled - pushed, 0)).max(axis=0) == pytest.approx(
        0, abs=2e-4 * pushed[-1].max()
    )
    assert shapes.slope[-1] == pytest.approx(EQUATOR, abs=1e-8)


@each
@pytest.mark.parametrize("pole", [1.05, 1.2, 1.6])
def test_a_barely_touched_balloon_is_the_free_sphere(rubber, pole):
    touched = shape(rubber, pole, 0.002)
    assert touched.pressure_kpa[0] == pytest.approx(rubber.free_kpa(pole), rel=1e-3)
    assert touched.half_height_mm[0] == pytest.approx(rubber.radius_mm * pole, rel=1e-3)
    assert touched.half_volume_mm3[0] == pytest.approx(
        2 / 3 * np.pi * (rubber.radius_mm * pole) ** 3, rel=1e-3
    )


@dataclass(frozen=True)
class SoapFilm:
    """Material with a constant tension, and a small elastic tension that keeps its points apart."""

    tension: float = 1.0
    rubber: float = 1e-4
    radius_mm: float = 1.0

    def tensions(self, along, around):
        thinning = (along * around) ** -3.0
        return Tensions(
            self.tension + self.rubber * (along / around - thinning),
            self.tension + self.rubber * (around / along - thinning),
            self.rubber * (1 / around + 3 * thinning / along),
            self.rubber * (3 * thinning - along / around) / around,
        )


@pytest.mark.parametrize(("flattening", "force"), [(0.1, 0.296907), (0.2, 0.817700), (0.4, 2.995809)])
def test_a_soap_film_of_constant_volume_carries_the_force_of_a_drop_between_plates(flattening, force):
    """Elliptic integrals give the force F/(γR₀) of a non-wetting drop at each relative flattening."""

    def residuals(unknowns):
        pressed = shape(SoapFilm(), *unknowns)
        return [
            2 * pressed.half_volume_mm3[0] / (4 / 3 * np.pi) - 1,
            1 - pressed.half_height_mm[0] - flattening,
        ]

    pole, share = fsolve(residuals, [1.0, np.sqrt(flattening)], xtol=1e-7)
    assert 1e3 * shape(SoapFilm(), pole, share).force_n[0] == pytest.approx(force, rel=2e-4)


@each
@pytest.mark.parametrize("beyond", [0.05, 0.2])
def test_the_work_of_the_plate_equals_the_energy_of_skin_and_gas(rubber, beyond):
    """For the pressed half, dE = −F dc + ΔP dV along any path of shapes, where c is the half height."""
    angles = np.linspace(0.1, 0.9, 161) * EQUATOR
    path = press(Skin(rubber), slack_limit(Skin(rubber), angles)[0] + beyond, angles)
    work = -1e3 * trapezoid(path.force_n, path.half_height_mm)
    filling = trapezoid(path.pressure_kpa, path.half_volume_mm3)
    rest = 2 * np.pi * rubber.radius_mm**2 * np.sin(path.angle)
    energy = simpson(rest * energy_kpa_mm(rubber, path.along, path.around), x=path.angle, axis=0)
    assert energy[-1] - energy[0] == pytest.approx(work + filling, abs=1e-3 * abs(filling))


@each
def test_a_shape_whose_skin_would_be_compressed_does_not_exist(rubber):
    low = slack_limit(Skin(rubber), np.array([0.5 * EQUATOR]))[0][0]
    assert low < 1
    assert np.isnan(shape(rubber, low - 0.001, 0.5).pressure_kpa[0])
    assert np.isfinite(shape(rubber, low + 0.002, 0.5).pressure_kpa[0])
