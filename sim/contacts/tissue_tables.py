"""Tables of a scenario file that describe tissue."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from pneuforce.sim.contacts.scenario_table import ScenarioTable
from pneuforce.sim.contacts.tissue import HalfSpace, Spring, Tissue


class HertzTable(ScenarioTable):
    """Elastic, incompressible half-space, pressed by a sphere."""

    law: Literal["hertz"] = "hertz"
    modulus_kpa: float = Field(ge=0.1, le=100_000)
    radius_mm: float = Field(8.0, ge=0.5, le=100)

    def tissue(self) -> Tissue:
        """Return the tissue of this table."""
        return HalfSpace(self.modulus_kpa, self.radius_mm)


class SpringTable(ScenarioTable):
    """Linear spring."""

    law: Literal["linear"] = "linear"
    stiffness_n_per_mm: float = Field(ge=0.01, le=1000)

    def tissue(self) -> Tissue:
        """Return the tissue of this table."""
        return Spring(self.stiffness_n_per_mm)


TissueTable = Annotated[HertzTable | SpringTable, Field(discriminator="law")]
