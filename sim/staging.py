"""Scenarios on stage: the rig that a scenario asks for, and the faults that it plans."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from sim.avr.board import AvrBoard
from sim.board import Board
from sim.faults import Planned, Schedule
from sim.hand import Hand
from sim.membrane.family import Progress
from sim.membrane.material import MOONEY_RIVLIN, NEO_HOOKEAN
from sim.membrane.plant import MembranePlant
from sim.plant import Plant
from sim.published import PublishedPlant
from sim.rig import AnyBoard, Rig
from sim.scenario import PlantTable, Scenario
from sim.world import World

#: In Python, or the firmware's own binary.
BOARDS: Mapping[str, Callable[[], AnyBoard]] = {"python": Board, "avr": AvrBoard}
MATERIALS = {"mooney-rivlin": MOONEY_RIVLIN, "neo-hookean": NEO_HOOKEAN}


def _silent(_done: int, _total: int) -> None:
    """Nobody wants to hear how far it is."""


def world_of(
    scenario: Scenario,
    works: bool = True,
    again: bool = True,
    progress: Progress = _silent,
    board: str = "python",
) -> World:
    """A rig just switched on, with the hand and the faults of a scenario.

    `works` says whether the hand plays the phases, `again` whether for ever. `progress(done, total)` hears
    how the table of a new membrane grows, which takes some seconds. `board` is one of `BOARDS`.
    """
    hand = Hand(works, scenario.phases, again)
    plant = plant_of(scenario.plant, progress)
    rig = Rig(plant, hand, scenario.seed, scenario.pneumatics, scenario.sensor, BOARDS[board])
    plan = [Planned(f.at_s, f.for_s, f.name, f.model_extra or {}) for f in scenario.fault]
    return World(rig, Schedule(plan))


def plant_of(table: PlantTable, progress: Progress = _silent) -> Plant:
    """The balloon that a table asks for."""
    if table.kind == "published":
        return PublishedPlant(low=table.low)
    return MembranePlant(MATERIALS[table.material], table.sides, progress)
