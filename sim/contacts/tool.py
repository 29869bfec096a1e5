"""Tool that a robot moves along the axis of the balloon, towards tissue or away from it."""

from __future__ import annotations

from pydantic import Field

from pneuforce.sim.contacts.push import Push, TravelPush
from pneuforce.sim.contacts.scenario_table import ScenarioTable
from pneuforce.sim.contacts.tissue import Rigid, Tissue
from pneuforce.sim.contacts.tissue_tables import TissueTable

MAX_SPEED_MM_PER_S = 100.0
#: Limits of the travel [mm]: the robot stops there.
TRAVEL_SPAN_MM = (-100.0, 50.0)
#: Highest acceleration of the robot [mm/s²] (assumed: a small robot arm at its tip).
ACCELERATION_MM_PER_S2 = 500.0
#: Time without a command after which the robot stops, as real robots do.
SILENCE_S = 0.2


class ToolTable(ScenarioTable):
    """Start of a movement: distance between balloon and tissue, and the tissue.

    Without tissue, the robot moves towards a rigid wall.
    """

    distance_mm: float = Field(5.0, ge=0, le=-TRAVEL_SPAN_MM[0])
    tissue: TissueTable | None = None

    def tool(self) -> MovedTool:
        """Return the tool at rest."""
        return MovedTool(self.tissue.tissue() if self.tissue else Rigid(), self.distance_mm)


class MovedTool:
    """Tool whose speed is commanded. Its speed changes at a limited rate.

    The travel is 0 where the balloon touches the tissue, and negative before.
    """

    def __init__(self, tissue: Tissue, distance_mm: float) -> None:
        self.push = TravelPush(tissue, -distance_mm)
        self.speed_mm_per_s = 0.0
        self._commanded_mm_per_s = 0.0
        self._silent_s = 0.0

    def command(self, speed_mm_per_s: float) -> None:
        """Set the speed; a positive speed moves towards the tissue. Repeat the command within 0.2 s."""
        self._commanded_mm_per_s, self._silent_s = speed_mm_per_s, 0.0

    def step(self, dt_s: float) -> Push:
        """Advance the time by `dt_s` and return the push."""
        self._silent_s += dt_s
        wanted = self._commanded_mm_per_s if self._silent_s <= SILENCE_S else 0.0
        change = ACCELERATION_MM_PER_S2 * dt_s
        self.speed_mm_per_s += min(max(wanted - self.speed_mm_per_s, -change), change)
        low_mm, high_mm = TRAVEL_SPAN_MM
        travel_mm = self.push.travel_mm + self.speed_mm_per_s * dt_s
        self.push.travel_mm = min(max(travel_mm, low_mm), high_mm)
        return self.push
