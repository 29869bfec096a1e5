"""Scenarios on stage: the rig that a scenario asks for."""

from __future__ import annotations

from sim.hand import Hand
from sim.plant import Plant
from sim.published import PublishedPlant
from sim.rig import Rig
from sim.scenario import PlantTable, Scenario, ScenarioError


def rig_of(scenario: Scenario, works: bool = True, again: bool = True) -> Rig:
    """A rig just switched on, with the hand of a scenario. Raises ScenarioError.

    `works` says whether the hand plays the phases, `again` whether for ever.
    """
    hand = Hand(works, scenario.phases, again)
    return Rig(plant_of(scenario.plant), hand, scenario.seed, scenario.pneumatics, scenario.sensor)


def plant_of(table: PlantTable) -> Plant:
    """The balloon that a table asks for. Raises ScenarioError."""
    if table.kind == "membrane":
        raise ScenarioError("plant, kind: 'membrane' is not part of this release yet")
    return PublishedPlant()
