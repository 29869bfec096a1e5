"""Tests of the variants of the force law: the switch at 8.85 kPa, and the force at low rise."""

import numpy as np
import pytest

from pneuforce.instrument.model import LIVE_LAW, PAPER_LAW, Balloon, Circuit, ForceLaw, estimate
from pneuforce.instrument.model.law import BLEND_KPA

BALLOON, CIRCUIT = Balloon(), Circuit()
BLEND, SMOOTH = ForceLaw(switch="blend"), ForceLaw(low="smooth")
RISES = np.geomspace(1e-3, 16, 300)
PRESSURES = np.linspace(4.95, 11.45, 80)[:, None]


def force(baseline_kpa, rise_kpa, law):
    return estimate(baseline_kpa, baseline_kpa + rise_kpa, BALLOON, CIRCUIT, law).force_n


@pytest.mark.parametrize("rise_kpa", [0.3, 1.0, 3.0])
@pytest.mark.parametrize(
    ("law", "min_jump", "max_jump"), [(PAPER_LAW, 0.16, 0.23), (BLEND, 0.0, 0.005)], ids=["paper", "blend"]
)
def test_the_force_jumps_at_the_switch_of_the_paper_but_not_with_the_blend(law, min_jump, max_jump, rise_kpa):
    """A step of ΔP_i by 0.02 kPa across 8.85 kPa changes the force of the paper by a fifth.

    With the blend, the force changes by less than 0.5 %.
    """
    jumps = [
        abs(force(p + 0.02, rise_kpa, law) / force(p, rise_kpa, law) - 1) for p in np.arange(7.8, 9.9, 0.02)
    ]
    assert min_jump < max(jumps) < max_jump


@pytest.mark.parametrize("baseline_kpa", [4.95, 8.85 - BLEND_KPA, 8.85 + BLEND_KPA + 1e-9, 11.45])
def test_away_from_the_switch_the_blend_is_the_law_of_the_paper(baseline_kpa):
    assert force(baseline_kpa, 1.0, BLEND) == pytest.approx(force(baseline_kpa, 1.0, PAPER_LAW), rel=1e-9)


@pytest.mark.parametrize("law", [PAPER_LAW, BLEND, SMOOTH, ForceLaw(switch="blend", low="smooth"), LIVE_LAW])
def test_every_variant_is_finite_and_rises_with_the_pressure_in_the_validated_range(law):
    forces = force(PRESSURES, RISES, law)
    assert np.isfinite(forces).all()
    assert (np.diff(forces, axis=1) > 0).all()


@pytest.mark.parametrize("baseline_kpa", [5.0, 8.0, 11.0])
def test_the_smooth_interpolation_has_the_slope_of_the_law_at_its_end_and_goes_to_zero(baseline_kpa):
    h = 1e-4
    below = (force(baseline_kpa, 0.5, SMOOTH) - force(baseline_kpa, 0.5 - h, SMOOTH)) / h
    above = (force(baseline_kpa, 0.5 + h, SMOOTH) - force(baseline_kpa, 0.5, SMOOTH)) / h
    assert below == pytest.approx(above, rel=0.01)
    assert force(baseline_kpa, 0.0, SMOOTH) == 0.0
    at_rise, at_four_times = force(baseline_kpa, 1e-6, SMOOTH), force(baseline_kpa, 4e-6, SMOOTH)
    assert at_four_times / at_rise == pytest.approx(2, rel=0.01)  # the force is proportional to √rise


@pytest.mark.parametrize("baseline_kpa", [5.0, 8.0, 11.0])
def test_the_interpolation_of_the_paper_is_a_straight_line(baseline_kpa):
    end = force(baseline_kpa, 0.5, PAPER_LAW)
    for share in (0.1, 0.5, 0.9):
        assert force(baseline_kpa, 0.5 * share, PAPER_LAW) == pytest.approx(share * end)
