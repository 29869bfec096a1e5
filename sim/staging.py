"""Scenarios on stage: the rig that a scenario asks for, and the faults that it plans."""

from __future__ import annotations

from sim.faults import Planned, Schedule
from sim.hand import Hand
from sim.plant import Plant
from sim.published import PublishedPlant
from sim.rig import Rig
from sim.scenario import PlantTable, Scenario, ScenarioError
from sim.world import World


def world_of(scenario: Scenario, works: bool = True, again: bool = True) -> World:
    """A rig just switched on, with the hand and the faults of a scenario. Raises ScenarioError.

    `works` says whether the hand plays the phases, `again` whether for ever.
    """
    hand = Hand(works, scenario.phases, again)
    rig = Rig(plant_of(scenario.plant), hand, scenario.seed, scenario.pneumatics, scenario.sensor)
    plan = [Planned(f.at_s, f.for_s, f.name, f.model_extra or {}) for f in scenario.fault]
    return World(rig, Schedule(plan))


def plant_of(table: PlantTable) -> Plant:
    """The balloon that a table asks for. Raises ScenarioError."""
    if table.kind == "membrane":
        raise ScenarioError("plant, kind: 'membrane' is not part of this release yet")
    return PublishedPlant()
