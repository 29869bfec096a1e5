"""Tests of the free inflation against closed-form solutions and the radius measured in the paper."""

import numpy as np
import pytest

from pneuforce.sim.plants.membrane.material import MOONEY_RIVLIN, NEO_HOOKEAN, RUBBERS, Gent, MooneyRivlin
from tests.sim.plants.membrane.identified import MEASURED_KPA, energy_kpa_mm, identify, measured_radius_mm

STRETCHES = [(1.0, 1.0), (1.1, 1.3), (1.4, 0.9), (0.97, 1.2), (2.0, 1.7)]
each = pytest.mark.parametrize("rubber", RUBBERS.values(), ids=list(RUBBERS))


@each
def test_the_constants_are_those_that_the_measured_radius_identifies(rubber):
    found = identify(rubber)
    assert rubber.mu_kpa == pytest.approx(found.mu_kpa, rel=1e-5)
    assert getattr(rubber, "alpha", 0) == pytest.approx(getattr(found, "alpha", 0), rel=1e-4)


@pytest.mark.parametrize(
    ("name", "worst_kpa", "rms_kpa"),
    [
        ("mooney-rivlin", 0.191, 0.091),
        ("neo-hookean", 0.497, 0.194),
        ("gent", 0.451, 0.175),
        ("ogden", 0.400, 0.151),
    ],
)
def test_the_fit_has_the_documented_residuals(name, worst_kpa, rms_kpa):
    rubber = RUBBERS[name]
    residuals_kpa = rubber.free_kpa(measured_radius_mm(MEASURED_KPA) / rubber.radius_mm) - MEASURED_KPA
    assert abs(residuals_kpa).max() == pytest.approx(worst_kpa, abs=5e-4)
    assert np.sqrt(np.mean(residuals_kpa**2)) == pytest.approx(rms_kpa, abs=5e-4)


@pytest.mark.parametrize("stretch", [1.02, 1.1, 1.4, 2.5])
def test_the_free_sphere_has_the_pressure_of_the_closed_form(stretch):
    """ΔP = h₀/(R₀λ²) dW/dλ for the equibiaxial energy of each law."""
    pull, scale = stretch**-1 - stretch**-7, 2 * 0.2 / 7.503
    gent, ogden = RUBBERS["gent"], RUBBERS["ogden"]
    left = 30 - (2 * stretch**2 + stretch**-4 - 3)
    assert gent.free_kpa(stretch) == pytest.approx(scale * gent.mu_kpa * pull * 30 / left)
    terms = zip((1.3, 5.0, -2.0), (6.3, 0.012, -0.1), strict=True)
    powers = sum(mu / 6.3 * (stretch ** (p - 3) - stretch ** (-2 * p - 3)) for p, mu in terms)
    assert ogden.free_kpa(stretch) == pytest.approx(scale * ogden.mu_kpa * powers)
    mooney = MOONEY_RIVLIN.free_kpa(stretch)
    assert mooney == pytest.approx(scale * 263.022 * pull * (1 + 0.38907 * stretch**2))


@pytest.mark.parametrize(
    ("name", "limit_kpa"), [("neo-hookean", 12.940), ("gent", 13.426), ("ogden", 13.144)]
)
def test_the_rubbers_have_the_documented_limit_points(name, limit_kpa):
    rubber = RUBBERS[name]
    limit = rubber.free_stretch(np.inf)
    assert rubber.free_kpa(limit) == pytest.approx(limit_kpa, abs=1e-3)
    assert rubber.free_kpa(limit + 0.02) < rubber.free_kpa(limit) > rubber.free_kpa(limit - 0.02)


def test_gent_rubber_has_no_tension_beyond_its_locking_stretch():
    rubber = Gent(locking=5.0)
    assert np.isfinite(rubber.tensions(1.9, 1.9).along)
    assert np.isnan(rubber.tensions(2.1, 2.1).along)


def test_a_neo_hookean_sphere_has_its_limit_point_at_the_sixth_root_of_seven():
    assert NEO_HOOKEAN.free_stretch(np.inf) == pytest.approx(7 ** (1 / 6), abs=2e-4)
    assert NEO_HOOKEAN.free_slope_kpa(7 ** (1 / 6)) == pytest.approx(0, abs=1e-12)
    assert NEO_HOOKEAN.free_kpa(7 ** (1 / 6)) == pytest.approx(12.94, abs=0.005)


def test_rubber_has_a_limit_point_only_below_an_alpha_of_0_2145():
    assert (MOONEY_RIVLIN.free_slope_kpa(np.linspace(1, 20, 100_000)) > 0).all()
    assert (MooneyRivlin(alpha=0.2145).free_slope_kpa(np.linspace(1, 20, 100_000)) > 0).all()
    assert (MooneyRivlin(alpha=0.2140).free_slope_kpa(np.linspace(1, 20, 100_000)) < 0).any()


@each
@pytest.mark.parametrize(("along", "around"), STRETCHES)
def test_tensions_are_the_derivatives_of_the_energy(rubber, along, around):
    """T1 = ∂(W h₀)/∂λ1 / λ2 and T2 = ∂(W h₀)/∂λ2 / λ1, by the complex-step derivative."""
    step, tensions = 1e-30, rubber.tensions(along, around)
    assert energy_kpa_mm(rubber, along + 1j * step, around).imag / step / around == pytest.approx(
        tensions.along
    )
    assert energy_kpa_mm(rubber, along, around + 1j * step).imag / step / along == pytest.approx(
        tensions.around
    )


@each
@pytest.mark.parametrize(("along", "around"), STRETCHES)
def test_the_derivatives_of_the_tension_are_correct(rubber, along, around):
    step, tensions = 1e-30, rubber.tensions(along, around)
    assert rubber.tensions(along + 1j * step, around).along.imag / step == pytest.approx(
        tensions.along_by_along
    )
    assert rubber.tensions(along, around + 1j * step).along.imag / step == pytest.approx(
        tensions.along_by_around
    )


@each
def test_a_free_sphere_is_in_equilibrium_by_laplace(rubber):
    for stretch in (1.01, 1.2, 1.38, 2.0):
        tension = rubber.tensions(stretch, stretch).along
        assert rubber.free_kpa(stretch) == pytest.approx(2 * tension / (rubber.radius_mm * stretch))


@each
def test_radius_and_pressure_of_the_free_sphere_are_inverses_up_to_the_limit_point(rubber):
    for pressure_kpa in np.linspace(0.1, 12.5, 40):
        assert rubber.free_kpa(rubber.free_stretch(pressure_kpa)) == pytest.approx(pressure_kpa, abs=1e-4)
    assert rubber.free_stretch(-3.0) == 1.0
