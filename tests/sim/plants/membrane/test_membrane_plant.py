import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pneuforce.sim.contacts.tissue import Rigid, force_at_travel
from pneuforce.sim.plants.membrane.material import Skin
from pneuforce.sim.plants.membrane.plant import MembranePlant
from pneuforce.sim.plants.membrane.shooting import EQUATOR, slack_limit
from pneuforce.sim.plants.plant import AMBIENT_KPA, MAX_PUSH_N, TUBES_MM3, Gas, amount_kpa_mm3
from tests.sim.plants.membrane.pressed_shapes import press

CIRCUITS = [(TUBES_MM3, AMBIENT_KPA), (TUBES_MM3 * 1.05, 97.0), (4_000.0, 103.0), (50.0, 101.0)]
FORCES_N = np.linspace(0, 3.5, 36)


def force_at(plant, gas, indentation_mm):
    return force_at_travel(indentation_mm, Rigid(), lambda force_n: plant.settle(gas, force_n).indentation_mm)


def gas_at(plant, pressure_kpa, tubes_mm3=TUBES_MM3, outside_kpa=AMBIENT_KPA):
    return Gas(amount_kpa_mm3(plant, pressure_kpa, tubes_mm3, outside_kpa), tubes_mm3, outside_kpa)


def random_shapes(plant, count=300):
    """Return shapes of the shooting method: pressure, volume, half height, contact radius, force."""
    rng = np.random.default_rng(5)
    angles = rng.uniform(0.05, 0.93, count) * EQUATOR
    skin = Skin(plant.material)
    shapes = press(skin, slack_limit(skin, angles)[0] + rng.uniform(0.03, 0.2, count), angles)
    halves, pressure = shapes.half_volume_mm3, shapes.pressure_kpa
    free = 2 / 3 * math.pi * np.array([plant.radius_mm(p) for p in pressure]) ** 3
    volumes = halves + (halves if plant.sides == 2 else free)
    known = (shapes.force_n < 6) & (pressure < 12.9 if plant.sides == 1 else pressure < 25)
    assert known.sum() > 100
    found = zip(
        pressure, volumes, shapes.half_height_mm, shapes.contact_radius_mm, shapes.force_n, strict=True
    )
    return [tuple(map(float, shape)) for shape, usable in zip(found, known, strict=True) if usable]


@pytest.mark.parametrize(("tubes_mm3", "outside_kpa"), CIRCUITS)
def test_the_table_agrees_with_the_shooting_method(plant, tubes_mm3, outside_kpa):
    for pressure, volume, height, contact, force in random_shapes(plant):
        gas = Gas((pressure + outside_kpa) * (volume + tubes_mm3), tubes_mm3, outside_kpa)
        state = plant.settle(gas, force)
        radius = (3 / 4 / math.pi * plant.settle(gas, 0.0).volume_mm3) ** (1 / 3)
        assert state.pressure_kpa == pytest.approx(pressure, abs=0.005)
        assert state.volume_mm3 == pytest.approx(volume, abs=2.0)
        assert state.indentation_mm == pytest.approx(radius - height, abs=0.003)
        assert state.contact_radius_mm == pytest.approx(contact, abs=0.003)


@pytest.mark.parametrize(
    ("baseline_kpa", "rise_kpa", "indentation_mm", "contact_mm", "force_n"),
    [(5, 1.051, 2.738, 5.215, 0.517), (8, 0.761, 2.151, 4.088, 0.460), (10, 2.887, 3.988, 6.146, 1.529)],
)
def test_the_sealed_balloon_agrees_with_another_solver(
    two_sided, baseline_kpa, rise_kpa, indentation_mm, contact_mm, force_n
):
    gas = gas_at(two_sided, baseline_kpa)
    state = two_sided.settle(gas, force_n)
    assert state.pressure_kpa == pytest.approx(baseline_kpa + rise_kpa, abs=0.002)
    assert state.indentation_mm == pytest.approx(indentation_mm, abs=0.001)
    assert state.contact_radius_mm == pytest.approx(contact_mm, abs=0.001)
    assert force_at(two_sided, gas, indentation_mm) == pytest.approx(force_n, abs=5e-4)


@pytest.mark.parametrize(("tubes_mm3", "outside_kpa"), CIRCUITS)
def test_the_free_balloon_has_the_pressure_and_radius_of_its_gas(plant, tubes_mm3, outside_kpa):
    for baseline_kpa in np.linspace(0.2, 12.4, 40):
        state = plant.settle(gas_at(plant, baseline_kpa, tubes_mm3, outside_kpa), 0.0)
        assert state.pressure_kpa == pytest.approx(baseline_kpa, abs=0.003)
        assert state.volume_mm3 == pytest.approx(
            4 / 3 * math.pi * plant.radius_mm(baseline_kpa) ** 3, abs=2.0
        )
        assert state.indentation_mm == state.contact_radius_mm == 0


@pytest.mark.parametrize(("tubes_mm3", "outside_kpa"), CIRCUITS[:3])
def test_pressure_and_indentation_rise_with_force_until_the_balloon_is_flat(plant, tubes_mm3, outside_kpa):
    for baseline_kpa in (1.0, 4.95, 8.0, 11.45):
        gas = gas_at(plant, baseline_kpa, tubes_mm3, outside_kpa)
        states = [plant.settle(gas, float(force)) for force in FORCES_N]
        for one, next_one in itertools.pairwise(states):
            flat = next_one.contact_radius_mm - one.contact_radius_mm < 1e-6
            rise_kpa = next_one.pressure_kpa - one.pressure_kpa
            deeper_mm = next_one.indentation_mm - one.indentation_mm
            assert (rise_kpa > 0 and deeper_mm > 0) or (flat and abs(rise_kpa) + abs(deeper_mm) < 1e-6)


@pytest.mark.parametrize("force_n", [0.0, 0.5, 3.5])
def test_pressure_rises_with_gas_if_the_rubber_has_no_limit_point(one_sided, force_n):
    low, high = amount_kpa_mm3(one_sided, -2.0), amount_kpa_mm3(one_sided, 16.0)
    states = [one_sided.settle(Gas(float(amount)), force_n) for amount in np.linspace(low, high, 500)]
    assert all(b.pressure_kpa > a.pressure_kpa for a, b in itertools.pairwise(states))
    assert all(b.volume_mm3 >= a.volume_mm3 for a, b in itertools.pairwise(states))


def test_beyond_its_limit_point_a_neo_hookean_balloon_grows_while_its_pressure_falls(with_limit_point):
    amount = amount_kpa_mm3(with_limit_point, 12.5)
    states = [with_limit_point.settle(Gas(amount * share), 0.0) for share in np.linspace(1, 1.4, 60)]
    pressures, volumes = [s.pressure_kpa for s in states], [s.volume_mm3 for s in states]
    assert max(pressures) == pytest.approx(12.94, abs=0.005)
    assert pressures[-1] < 11.8
    assert all(b > a for a, b in itertools.pairwise(volumes))


def test_a_press_on_one_side_raises_the_pressure_less_than_on_two_sides(two_sided, with_limit_point):
    rises = [p.settle(gas_at(p, 8.0), 1.0).pressure_kpa for p in (with_limit_point, two_sided)]
    assert 8.0 < rises[0] < rises[1]


def test_a_push_that_flattens_the_balloon_moves_its_gas_to_the_tubes(two_sided):
    gas = gas_at(two_sided, 8.0)
    state = two_sided.settle(gas, 30.0)
    assert state.pressure_kpa == pytest.approx(gas.amount_kpa_mm3 / TUBES_MM3 - AMBIENT_KPA, abs=0.02)
    assert state.indentation_mm == pytest.approx(two_sided.radius_mm(8.0), abs=0.003)


@given(
    amount=st.floats(0, 1e8),
    tubes_mm3=st.floats(0, 1e5),
    outside_kpa=st.floats(20, 200),
    force_n=st.floats(-1, 1e6),
)
@settings(max_examples=300)
def test_the_state_is_finite_for_any_gas_and_force(
    one_sided, with_limit_point, amount, tubes_mm3, outside_kpa, force_n
):
    for balloon in (one_sided, with_limit_point):
        state = balloon.settle(Gas(amount, tubes_mm3, outside_kpa), force_n)
        assert all(map(math.isfinite, state))
        assert state.volume_mm3 > 0
        assert state.indentation_mm >= 0
        held = (state.pressure_kpa + outside_kpa) * (tubes_mm3 + state.volume_mm3)
        assert held == pytest.approx(amount, rel=1e-9, abs=1e-3)


def test_the_force_at_an_indentation_gives_that_indentation(plant):
    for baseline_kpa, force_n in itertools.product((5.0, 8.0, 11.0), (0.05, 1.0, 3.0)):
        gas = gas_at(plant, baseline_kpa)
        indentation_mm = plant.settle(gas, force_n).indentation_mm
        assert force_at(plant, gas, indentation_mm) == pytest.approx(force_n, abs=1e-4)


def test_the_force_is_zero_without_indentation_and_limited_at_large_indentations(one_sided):
    gas = gas_at(one_sided, 8.0)
    assert force_at(one_sided, gas, 0.0) == force_at(one_sided, gas, -1.0) == 0
    assert force_at(one_sided, gas, 20.0) == pytest.approx(MAX_PUSH_N)


def test_other_numbers_of_sides_are_rejected():
    with pytest.raises(ValueError, match="1 or 2 sides, not 3"):
        MembranePlant(sides=3)
