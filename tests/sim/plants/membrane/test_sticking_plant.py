"""Tests of the sticking contact and of the contacts between sliding and sticking, in the simulated rig."""

import math
from typing import get_args

import numpy as np
import pytest

from pneuforce.instrument.cli.sim.plant_options import RubberName
from pneuforce.sim.plants.membrane.material import RUBBERS, Skin
from pneuforce.sim.plants.membrane.paths import PressedBalloon
from pneuforce.sim.plants.membrane.plant import MembranePlant
from pneuforce.sim.plants.membrane.press_path import press_path
from pneuforce.sim.plants.plant import Gas, amount_kpa_mm3
from pneuforce.sim.scenario import PlantTable

BASELINES_KPA, FORCES_N = [5.0, 8.0, 11.0], [0.3, 1.0, 2.0, 3.0]


def states(plant, baseline_kpa):
    gas = Gas(amount_kpa_mm3(plant, baseline_kpa))
    return [plant.settle(gas, force_n) for force_n in FORCES_N]


@pytest.mark.parametrize("name", ["one_sided", "sticking"])
def test_the_table_agrees_with_the_presses_of_the_balloon(request, name):
    plant = request.getfixturevalue(name)
    balloon = PressedBalloon(Skin(plant.material), plant.sides, plant.contact)
    path = press_path(balloon, BASELINES_KPA).at(FORCES_N)
    for column, baseline_kpa in enumerate(BASELINES_KPA):
        found = np.array([state[:3] for state in states(plant, baseline_kpa)])
        assert found[:, 0] == pytest.approx(path.final_kpa[:, column], abs=5e-4)
        assert found[:, 1] == pytest.approx(path.indentation_mm[:, column], abs=2e-3)
        assert found[:, 2] == pytest.approx(path.contact_radius_mm[:, column], abs=1e-3)


def test_the_force_of_a_sticking_balloon_is_the_pressure_on_the_contact(sticking):
    for baseline_kpa in BASELINES_KPA:
        for force_n, state in zip(FORCES_N, states(sticking, baseline_kpa), strict=True):
            assert force_n == pytest.approx(1e-3 * state.pressure_kpa * math.pi * state.contact_radius_mm**2)


def test_a_number_as_contact_interpolates_between_sliding_and_sticking(one_sided, sticking):
    between = MembranePlant(contact=0.25)
    for baseline_kpa in BASELINES_KPA:
        slide, stick, found = (
            np.array(states(plant, baseline_kpa)) for plant in (one_sided, sticking, between)
        )
        assert (stick[:, 0] < slide[:, 0] - 0.02).all()
        assert found[:, :2] == pytest.approx(0.75 * slide[:, :2] + 0.25 * stick[:, :2], abs=1e-3)


@pytest.mark.parametrize("contact", [-0.1, 1.1, math.nan])
def test_numbers_outside_0_to_1_are_rejected(contact):
    with pytest.raises(ValueError, match="0 to 1"):
        MembranePlant(contact=contact)


def test_scenarios_and_commands_know_all_rubbers():
    assert list(RUBBERS) == list(get_args(RubberName))
    assert list(RUBBERS) == list(get_args(PlantTable.model_fields["material"].annotation))
