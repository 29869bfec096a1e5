"""Scenarios on stage: the rig that a scenario asks for, and the faults that it plans."""

from __future__ import annotations

from sim.faults import Planned, Schedule
from sim.hand import Hand
from sim.plant import Plant
from sim.published import PublishedPlant
from sim.rig import Rig
from sim.scenario import PlantTable, Scenario
from sim.world import World


def world_of(scenario: Scenario, works: bool = True, again: bool = True) -> World:
    """A rig just switched on, with the hand and the faults of a scenario.

    `works` says whether the hand plays the phases, `again` whether for ever.
    """
    hand = Hand(works, scenario.phases, again)
    rig = Rig(plant_of(scenario.plant), hand, scenario.seed, scenario.pneumatics, scenario.sensor)
    plan = [Planned(f.at_s, f.for_s, f.name, f.model_extra or {}) for f in scenario.fault]
    return World(rig, Schedule(plan))


def plant_of(table: PlantTable) -> Plant:
    """The balloon that a table asks for. The first membrane of its kind takes some seconds to reckon."""
    if table.kind == "published":
        return PublishedPlant()
    from sim.membrane.material import MOONEY_RIVLIN, NEO_HOOKEAN
    from sim.membrane.plant import MembranePlant

    material = {"mooney-rivlin": MOONEY_RIVLIN, "neo-hookean": NEO_HOOKEAN}[table.material]
    return MembranePlant(material, table.sides)
