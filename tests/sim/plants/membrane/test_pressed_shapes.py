"""The pressed shape, against facts that are older than this code."""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.integrate import simpson, trapezoid
from scipy.optimize import fsolve

from sim.membrane.material import MOONEY_RIVLIN, NEO_HOOKEAN, Tensions
from sim.membrane.shooting import EQUATOR, press, slack
from tests.sim.membrane.identified import energy_kpa_mm

SHARES = np.array([0.02, 0.1, 0.3, 0.5, 0.7, 0.85, 0.95])
both = pytest.mark.parametrize("rubber", [MOONEY_RIVLIN, NEO_HOOKEAN])


def shape(rubber, pole, share):
    return press(rubber, np.array([pole]), np.array([share * EQUATOR]))


@both
@pytest.mark.parametrize("beyond", [0.03, 0.1, 0.3])
def test_every_ring_carries_the_pressure_on_the_area_beyond_the_plate(rubber, beyond):
    """2πr T1 sin θ = ΔP π (r² − a²): a global balance, while the shots use local ones."""
    angles = SHARES * EQUATOR
    shapes = press(rubber, slack(rubber, angles)[0] + beyond, angles)
    tension = rubber.tensions(shapes.along, shapes.around).along
    free = shapes.angle >= angles
    pulled = 2 * shapes.r_mm * tension * np.sin(shapes.slope)
    pushed = shapes.pressure_kpa * (shapes.r_mm**2 - shapes.contact_radius_mm**2)
    assert abs(np.where(free, pulled - pushed, 0)).max(axis=0) == pytest.approx(
        0, abs=2e-4 * pushed[-1].max()
    )
    assert shapes.slope[-1] == pytest.approx(EQUATOR, abs=1e-8)


@both
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
    """A tension that does not know its stretch, and a trace of rubber that keeps its points apart."""

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
def test_a_soap_film_of_constant_volume_carries_what_a_drop_between_plates_does(flattening, force):
    """F/(γR₀) of a drop that does not wet, by the share of its diameter that is lost: elliptic integrals."""

    def missing(unknowns):
        pressed = shape(SoapFilm(), *unknowns)
        return [
            2 * pressed.half_volume_mm3[0] / (4 / 3 * np.pi) - 1,
            1 - pressed.half_height_mm[0] - flattening,
        ]

    pole, share = fsolve(missing, [1.0, np.sqrt(flattening)], xtol=1e-7)
    assert 1e3 * shape(SoapFilm(), pole, share).force_n[0] == pytest.approx(force, rel=2e-4)


@both
@pytest.mark.parametrize("beyond", [0.05, 0.2])
def test_the_plate_does_the_work_that_skin_and_gas_take_up(rubber, beyond):
    """dE = −F dc + ΔP dV of the pressed half, along any path of shapes; c is the half height."""
    angles = np.linspace(0.1, 0.9, 161) * EQUATOR
    path = press(rubber, slack(rubber, angles)[0] + beyond, angles)
    work = -1e3 * trapezoid(path.force_n, path.half_height_mm)
    filling = trapezoid(path.pressure_kpa, path.half_volume_mm3)
    rest = 2 * np.pi * rubber.radius_mm**2 * np.sin(path.angle)
    energy = simpson(rest * energy_kpa_mm(rubber, path.along, path.around), x=path.angle, axis=0)
    assert energy[-1] - energy[0] == pytest.approx(work + filling, abs=1e-3 * abs(filling))


def test_a_shape_whose_skin_would_have_to_push_does_not_exist():
    low = slack(MOONEY_RIVLIN, np.array([0.5 * EQUATOR]))[0][0]
    assert low < 1
    assert np.isnan(shape(MOONEY_RIVLIN, low - 0.001, 0.5).pressure_kpa[0])
    assert np.isfinite(shape(MOONEY_RIVLIN, low + 0.002, 0.5).pressure_kpa[0])
