"""Construction of simulated rigs from scenarios."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from pneuforce.sim.avr.board import AvrBoard
from pneuforce.sim.board import SimulatedBoard
from pneuforce.sim.faults import FaultSchedule, ScheduledFault
from pneuforce.sim.hand import Hand
from pneuforce.sim.plants.membrane.material import RUBBERS
from pneuforce.sim.plants.membrane.plant import MembranePlant
from pneuforce.sim.plants.membrane.table import ProgressCallback
from pneuforce.sim.plants.plant import Plant
from pneuforce.sim.plants.published import PublishedPlant
from pneuforce.sim.rig import BoardProtocol, Rig
from pneuforce.sim.scenario import PlantTable, Scenario
from pneuforce.sim.world import World

#: Boards by name: the Python board, and the firmware on an emulated chip.
BOARDS: Mapping[str, Callable[[], BoardProtocol]] = {"python": SimulatedBoard, "avr": AvrBoard}


def _ignore_progress(_done: int, _total: int) -> None:
    """Ignore the progress."""


def build_world(
    scenario: Scenario,
    plays_phases: bool = True,
    repeat: bool = True,
    progress: ProgressCallback = _ignore_progress,
    board: str = "python",
) -> World:
    """Return a rig that has just been switched on, with the hand and the faults of a scenario.

    With `plays_phases`, the hand plays the phases of the scenario; with `repeat`, it repeats them endlessly.
    `progress(done, total)` is called while the table of a new membrane balloon is computed, which takes
    some seconds. `board` is a key of `BOARDS`.
    """
    hand = Hand(plays_phases, scenario.phases, repeat)
    plant = build_plant(scenario.plant, progress)
    rig = Rig(plant, hand, scenario.seed, scenario.pneumatics, scenario.sensor, BOARDS[board])
    schedule = [ScheduledFault(f.at_s, f.for_s, f.name, f.model_extra or {}) for f in scenario.fault]
    return World(rig, FaultSchedule(schedule))


def build_plant(table: PlantTable, progress: ProgressCallback = _ignore_progress) -> Plant:
    """Return the simulated balloon that a table of a scenario describes."""
    if table.kind == "published":
        return PublishedPlant(low=table.low)
    return MembranePlant(RUBBERS[table.material], table.sides, progress, table.contact)
