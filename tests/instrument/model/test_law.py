"""What is done where the paper's law steps, and where it ends."""

import numpy as np
import pytest

from instrument.model import LIVE, PAPER, Balloon, Circuit, Law, estimate
from instrument.model.law import BLEND_KPA

BALLOON, CIRCUIT = Balloon(), Circuit()
BLEND, SMOOTH = Law(switch="blend"), Law(low="smooth")
RISES = np.geomspace(1e-3, 16, 300)
PRESSURES = np.linspace(4.95, 11.45, 80)[:, None]


def force(initial_kpa, rise_kpa, law):
    return estimate(initial_kpa, initial_kpa + rise_kpa, BALLOON, CIRCUIT, law).force_n


@pytest.mark.parametrize("rise_kpa", [0.3, 1.0, 3.0])
@pytest.mark.parametrize(
    ("law", "least", "most"), [(PAPER, 0.16, 0.23), (BLEND, 0.0, 0.005)], ids=["paper", "blend"]
)
def test_a_baseline_that_moves_by_0_02_kpa_changes_the_force_by(law, least, most, rise_kpa):
    """The paper's switch moves it by a fifth as that crosses 8.85 kPa, the blend by half a percent."""
    jumps = [
        abs(force(p + 0.02, rise_kpa, law) / force(p, rise_kpa, law) - 1) for p in np.arange(7.8, 9.9, 0.02)
    ]
    assert least < max(jumps) < most


@pytest.mark.parametrize("initial_kpa", [4.95, 8.85 - BLEND_KPA, 8.85 + BLEND_KPA + 1e-9, 11.45])
def test_away_from_the_switch_the_blend_is_the_papers_law(initial_kpa):
    assert force(initial_kpa, 1.0, BLEND) == pytest.approx(force(initial_kpa, 1.0, PAPER), rel=1e-9)


@pytest.mark.parametrize("law", [PAPER, BLEND, SMOOTH, Law(switch="blend", low="smooth"), LIVE])
def test_every_variant_exists_and_rises_with_the_pressure_over_the_whole_range(law):
    forces = force(PRESSURES, RISES, law)
    assert np.isfinite(forces).all()
    assert (np.diff(forces, axis=1) > 0).all()


@pytest.mark.parametrize("initial_kpa", [5.0, 8.0, 11.0])
def test_the_smooth_join_meets_the_law_with_its_slope_and_goes_to_zero(initial_kpa):
    h = 1e-4
    below = (force(initial_kpa, 0.5, SMOOTH) - force(initial_kpa, 0.5 - h, SMOOTH)) / h
    above = (force(initial_kpa, 0.5 + h, SMOOTH) - force(initial_kpa, 0.5, SMOOTH)) / h
    assert below == pytest.approx(above, rel=0.01)
    assert force(initial_kpa, 0.0, SMOOTH) == 0.0
    quarter, whole = force(initial_kpa, 1e-6, SMOOTH), force(initial_kpa, 4e-6, SMOOTH)
    assert whole / quarter == pytest.approx(2, rel=0.01)  # like the square root of the rise


@pytest.mark.parametrize("initial_kpa", [5.0, 8.0, 11.0])
def test_the_line_is_straight(initial_kpa):
    end = force(initial_kpa, 0.5, PAPER)
    for share in (0.1, 0.5, 0.9):
        assert force(initial_kpa, 0.5 * share, PAPER) == pytest.approx(share * end)
