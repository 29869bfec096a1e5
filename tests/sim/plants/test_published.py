import itertools
import math

import numpy as np
import pytest

from pneuforce.instrument.model import ForceLaw, estimate
from pneuforce.sim.plants.plant import Gas, amount_kpa_mm3
from pneuforce.sim.plants.published import PublishedPlant

PLANT = PublishedPlant()
BASELINES_KPA = np.concatenate([np.linspace(2.03, 8.84, 29), np.linspace(8.87, 15.9, 23)])
RISES_KPA = [0.05, 0.3, 0.49, 0.51, 0.6, 0.77, 1.03, 2.21, 4.4, 7.9, 11.3]


def pressed(baseline_kpa, force_n):
    return PLANT.settle(Gas(amount_kpa_mm3(PLANT, baseline_kpa)), force_n)


def test_the_free_balloon_has_the_pressure_and_radius_of_its_gas():
    for baseline_kpa in np.linspace(0, 15, 61):
        state = pressed(float(baseline_kpa), 0.0)
        assert state.pressure_kpa == pytest.approx(baseline_kpa, abs=1e-4)
        assert state.volume_mm3 == pytest.approx(
            4 / 3 * math.pi * PLANT.radius_mm(baseline_kpa) ** 3, rel=1e-4
        )
        assert state.indentation_mm == state.contact_radius_mm == 0


def test_the_energetic_law_gives_the_force_from_the_pressures_of_the_pressed_balloon():
    """The force agrees within 0.5 % over the complete table, also for a rise below 0.5 kPa."""
    for baseline_kpa, rise_kpa in itertools.product(BASELINES_KPA, RISES_KPA):
        start, end = float(baseline_kpa), float(baseline_kpa + rise_kpa)
        law = estimate(start, end, PLANT.balloon, PLANT.circuit)
        state = pressed(start, law.force_n)
        estimated = estimate(start, state.pressure_kpa, PLANT.balloon, PLANT.circuit)
        assert estimated.force_n == pytest.approx(law.force_n, rel=5e-3), (baseline_kpa, rise_kpa)
        assert state.indentation_mm == pytest.approx(law.indentation_mm, rel=5e-3)
        assert state.contact_radius_mm == pytest.approx(law.contact_radius_mm, rel=5e-3)


def test_a_force_beyond_the_table_gives_a_rise_of_16_kpa():
    assert pressed(8.0, 20.0).pressure_kpa == pytest.approx(24.0, abs=1e-3)


def test_pressure_rises_with_force_and_with_gas():
    rising = [pressed(8.0, f).pressure_kpa for f in np.linspace(0, 9, 200)]
    assert all(b > a for a, b in itertools.pairwise(rising))
    filling = [pressed(float(p), 0.0).pressure_kpa for p in np.linspace(0, 14, 200)]
    assert all(b > a for a, b in itertools.pairwise(filling))


@pytest.mark.parametrize("baseline_kpa", [-1.0, 0.0, 0.2, 25.0])
@pytest.mark.parametrize("force_n", [0.0, 0.5, 20.0])
def test_the_state_is_finite_outside_the_table(baseline_kpa, force_n):
    assert all(math.isfinite(number) for number in pressed(baseline_kpa, force_n))


@pytest.mark.parametrize("edge_kpa", [-3.7, 40.0])
def test_the_volume_is_constant_outside_the_range_of_the_quadratic(edge_kpa):
    at_edge = amount_kpa_mm3(PLANT, edge_kpa)
    volume_mm3 = 4 / 3 * math.pi * PLANT.radius_mm(edge_kpa) ** 3
    for share in (1.0, 1.01, 1.2) if edge_kpa > 0 else (1.0, 0.99, 0.5):
        state = PLANT.settle(Gas(at_edge * share), 0.0)
        assert state.volume_mm3 == pytest.approx(volume_mm3, rel=1e-5)
        assert state.pressure_kpa + 101.325 == pytest.approx(share * (edge_kpa + 101.325), rel=1e-6)


def test_an_empty_balloon_has_no_pressure_under_a_force():
    assert pressed(0.0, 3.0).pressure_kpa == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("baseline_kpa", [5.0, 8.0, 11.0])
@pytest.mark.parametrize("rise_kpa", [0.002, 0.02, 0.1, 0.4, 0.6])
def test_the_smooth_join_below_half_a_kpa_agrees_with_the_force_law(baseline_kpa, rise_kpa):
    plant, law = PublishedPlant(low="smooth"), ForceLaw(low="smooth")
    force_n = estimate(baseline_kpa, baseline_kpa + rise_kpa, plant.balloon, plant.circuit, law).force_n
    state = plant.settle(Gas(amount_kpa_mm3(plant, baseline_kpa)), force_n)
    assert state.pressure_kpa - baseline_kpa == pytest.approx(rise_kpa, rel=0.02, abs=2e-4)
