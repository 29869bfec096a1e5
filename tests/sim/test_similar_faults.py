"""Tests of the names that the error about an unknown fault suggests."""

import pytest

from pneuforce.sim.faults import CATALOGUE, SimulatorRequestError
from pneuforce.sim.faults.injection import fault_kind
from pneuforce.sim.faults.similar import _SYNONYMS, similar_names


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("leek", ["leak"]),
        ("occlusion", ["regulator_high", "occluded"]),
        ("kinked_tube", ["occluded"]),
        ("Kinked tube", ["occluded"]),
        ("no rise", ["no_supply", "inlet_shut"]),
        ("cable", ["cable_pulled"]),
        ("kink", ["occluded"]),
        ("tube_blocked", ["occluded", "inlet_shut", "vent_shut"]),
        ("clogged", ["occluded", "inlet_shut", "vent_shut"]),
        ("USB", ["cable_pulled"]),
        ("power", ["board_reset", "supply_low", "supply_high"]),
        ("the", []),
        ("", []),
    ],
)
def test_an_unknown_name_suggests_the_faults_that_it_can_mean(name, meant):
    assert similar_names(name) == meant


def test_the_synonyms_name_faults_of_the_catalogue():
    assert {fault for faults in _SYNONYMS.values() for fault in faults} <= set(CATALOGUE)


def test_without_a_suggestion_the_error_lists_all_names():
    with pytest.raises(SimulatorRequestError) as rejected:
        fault_kind("gremlin")
    assert all(name in str(rejected.value) for name in CATALOGUE)
    with pytest.raises(SimulatorRequestError, match=r"similar: occluded\)"):
        fault_kind("kinked_tube")
    with pytest.raises(SimulatorRequestError, match=r"sim fault leak --off\)"):
        fault_kind("off")
