"""Tests of the rubber skin: derivatives, free inflation, and the fit to measured radii."""

import numpy as np
import pytest

from pneuforce.instrument.model import Balloon
from pneuforce.instrument.model.rubber import RubberSkin, fit_skin, skin_of

SKIN = RubberSkin(7.503, 26.3, 10.23)


def energy(along, around, skin=SKIN):
    across = 1 / (along * around)
    return skin.c1_kpa_mm * (along**2 + around**2 + across**2 - 3) + skin.c2_kpa_mm * (
        along**-2 + around**-2 + across**-2 - 3
    )


@pytest.mark.parametrize(("along", "around"), [(1.0, 1.0), (1.1, 1.05), (0.97, 1.3), (1.4, 1.2)])
def test_the_derivatives_are_those_of_the_energy(along, around):
    h = 1e-4
    (w1, w2), (w11, w22, w12) = SKIN.energy_derivatives(along, around)
    assert w1 == pytest.approx((energy(along + h, around) - energy(along - h, around)) / (2 * h), abs=1e-5)
    assert w2 == pytest.approx((energy(along, around + h) - energy(along, around - h)) / (2 * h), abs=1e-5)
    up, down = SKIN.energy_derivatives(along + h, around), SKIN.energy_derivatives(along - h, around)
    assert w11 == pytest.approx((up.first[0] - down.first[0]) / (2 * h), rel=1e-6)
    assert w12 == pytest.approx((up.first[1] - down.first[1]) / (2 * h), rel=1e-6)
    up, down = SKIN.energy_derivatives(along, around + h), SKIN.energy_derivatives(along, around - h)
    assert w22 == pytest.approx((up.first[1] - down.first[1]) / (2 * h), rel=1e-6)


def test_the_free_pressure_does_the_work_of_the_energy():
    """On a free sphere, ΔP dV = dE with E = 4π R_0² W(λ, λ) and V = 4/3 π (R_0 λ)³."""
    stretch, h = np.linspace(1.02, 1.5, 20), 1e-5
    work = (
        4 * np.pi * 7.503**2 * (energy(stretch + h, stretch + h) - energy(stretch - h, stretch - h)) / (2 * h)
    )
    volume_rate = 4 * np.pi * 7.503**3 * stretch**2
    assert SKIN.free_kpa(stretch) == pytest.approx(work / volume_rate, rel=1e-6)
    slope = (SKIN.free_kpa(stretch + h) - SKIN.free_kpa(stretch - h)) / (2 * h)
    assert SKIN.free_slope_kpa(stretch) == pytest.approx(slope, rel=1e-6)


def test_the_stretch_of_the_free_sphere_belongs_to_its_pressure():
    pressure = np.array([0.0, 0.1, 5.0, 11.45])
    stretch = SKIN.free_stretch(pressure)
    assert stretch[0] == 1.0
    assert SKIN.free_kpa(stretch) == pytest.approx(pressure, abs=1e-9)
    volume, by_pressure = SKIN.free_volume_mm3(pressure)
    higher, lower = (SKIN.free_volume_mm3(pressure + h)[0] for h in (1e-4, -1e-4))
    assert volume == pytest.approx(4 / 3 * np.pi * (7.503 * stretch) ** 3)
    assert by_pressure[1:] == pytest.approx((higher - lower)[1:] / 2e-4, rel=1e-5)


def test_above_the_limit_point_there_is_no_free_sphere():
    neo_hookean = RubberSkin(7.5, 39.0, 0.0)
    limit_kpa = neo_hookean.free_kpa(7 ** (1 / 6))
    stretch = neo_hookean.free_stretch(np.array([limit_kpa - 0.01, limit_kpa + 0.01]))
    assert stretch[0] < 7 ** (1 / 6)
    assert np.isnan(stretch[1])


def test_the_fit_finds_the_constants_of_exact_radii():
    pressure = np.linspace(2, 12, 12)
    found = fit_skin(pressure, SKIN.rest_radius_mm * SKIN.free_stretch(pressure))
    assert found.rest_radius_mm == pytest.approx(SKIN.rest_radius_mm, abs=1e-3)
    assert (found.c1_kpa_mm, found.c2_kpa_mm) == pytest.approx((26.3, 10.23), rel=0.01)


def test_without_measured_radii_the_skin_follows_the_quadratic_of_the_paper():
    pressure = np.linspace(4.95, 11.45, 14)
    radius = skin_of(Balloon()).rest_radius_mm * skin_of(Balloon()).free_stretch(pressure)
    assert radius == pytest.approx(Balloon().radius_mm(pressure), abs=0.02)


def test_an_error_of_the_radius_moves_the_whole_free_curve():
    pressure = np.linspace(4.95, 11.45, 14)
    skin, larger = skin_of(Balloon()), skin_of(Balloon(), 0.05)
    change = larger.rest_radius_mm * larger.free_stretch(pressure) - skin.rest_radius_mm * skin.free_stretch(
        pressure
    )
    assert larger.rest_radius_mm == skin.rest_radius_mm
    assert change == pytest.approx(0.05, abs=0.02)
