import itertools
import math

import numpy as np
import pytest

from instrument.model import Law, estimate
from sim.plant import Gas, amount_kpa_mm3
from sim.published import PublishedPlant

PLANT = PublishedPlant()
INITIALS = np.concatenate([np.linspace(2.03, 8.84, 29), np.linspace(8.87, 15.9, 23)])
RISES = [0.05, 0.3, 0.49, 0.51, 0.6, 0.77, 1.03, 2.21, 4.4, 7.9, 11.3]


def pressed(initial_kpa, force_n):
    return PLANT.settle(Gas(amount_kpa_mm3(PLANT, initial_kpa)), force_n)


def test_the_free_balloon_has_the_pressure_and_the_radius_that_its_gas_gives_it():
    for initial_kpa in np.linspace(0, 15, 61):
        state = pressed(float(initial_kpa), 0.0)
        assert state.pressure_kpa == pytest.approx(initial_kpa, abs=1e-4)
        assert state.volume_mm3 == pytest.approx(
            4 / 3 * math.pi * PLANT.radius_mm(initial_kpa) ** 3, rel=1e-4
        )
        assert state.indentation_mm == state.contact_radius_mm == 0


def test_pressed_with_a_force_it_shows_the_pressures_from_which_the_energetic_law_gives_that_force():
    """Within 0.5 % of the force, over the whole table and below a rise of 0.5 kPa."""
    for initial_kpa, rise_kpa in itertools.product(INITIALS, RISES):
        start, end = float(initial_kpa), float(initial_kpa + rise_kpa)
        law = estimate(start, end, PLANT.balloon, PLANT.circuit)
        state = pressed(start, law.force_n)
        told = estimate(start, state.pressure_kpa, PLANT.balloon, PLANT.circuit)
        assert told.force_n == pytest.approx(law.force_n, rel=5e-3), (initial_kpa, rise_kpa)
        assert state.indentation_mm == pytest.approx(law.indentation_mm, rel=5e-3)
        assert state.contact_radius_mm == pytest.approx(law.contact_radius_mm, rel=5e-3)


def test_a_harder_push_than_the_table_knows_ends_at_a_rise_of_16_kpa():
    assert pressed(8.0, 20.0).pressure_kpa == pytest.approx(24.0, abs=1e-3)


def test_pressure_rises_with_force_and_with_gas():
    rising = [pressed(8.0, f).pressure_kpa for f in np.linspace(0, 9, 200)]
    assert all(b > a for a, b in itertools.pairwise(rising))
    filling = [pressed(float(p), 0.0).pressure_kpa for p in np.linspace(0, 14, 200)]
    assert all(b > a for a, b in itertools.pairwise(filling))


@pytest.mark.parametrize("initial_kpa", [-1.0, 0.0, 0.2, 25.0])
@pytest.mark.parametrize("force_n", [0.0, 0.5, 20.0])
def test_outside_its_table_the_balloon_is_still_a_finite_thing(initial_kpa, force_n):
    assert all(math.isfinite(number) for number in pressed(initial_kpa, force_n))


@pytest.mark.parametrize("edge_kpa", [-3.7, 40.0])
def test_beyond_the_measured_quadratic_it_keeps_its_volume(edge_kpa):
    at_edge = amount_kpa_mm3(PLANT, edge_kpa)
    volume_mm3 = 4 / 3 * math.pi * PLANT.radius_mm(edge_kpa) ** 3
    for share in (1.0, 1.01, 1.2) if edge_kpa > 0 else (1.0, 0.99, 0.5):
        state = PLANT.settle(Gas(at_edge * share), 0.0)
        assert state.volume_mm3 == pytest.approx(volume_mm3, rel=1e-5)
        assert state.pressure_kpa + 101.325 == pytest.approx(share * (edge_kpa + 101.325), rel=1e-6)


def test_an_empty_balloon_carries_no_pressure():
    assert pressed(0.0, 3.0).pressure_kpa == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("initial_kpa", [5.0, 8.0, 11.0])
@pytest.mark.parametrize("rise_kpa", [0.002, 0.02, 0.1, 0.4, 0.6])
def test_a_smooth_join_below_half_a_kpa_is_the_laws_own(initial_kpa, rise_kpa):
    plant, law = PublishedPlant(low="smooth"), Law(low="smooth")
    force_n = estimate(initial_kpa, initial_kpa + rise_kpa, plant.balloon, plant.circuit, law).force_n
    state = plant.settle(Gas(amount_kpa_mm3(plant, initial_kpa)), force_n)
    assert state.pressure_kpa - initial_kpa == pytest.approx(rise_kpa, rel=0.02, abs=2e-4)
