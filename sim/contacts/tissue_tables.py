"""The laws of tissue as tables of a scenario file."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from sim.contacts.table import Table
from sim.contacts.tissue import HalfSpace, Spring, Tissue


class Hertz(Table):
    """A deep, incompressible, elastic body under a sphere."""

    law: Literal["hertz"] = "hertz"
    modulus_kpa: float = Field(ge=0.1, le=100_000)
    radius_mm: float = Field(8.0, ge=0.5, le=100)

    def tissue(self) -> Tissue:
        """The tissue of this table."""
        return HalfSpace(self.modulus_kpa, self.radius_mm)


class Linear(Table):
    """A spring."""

    law: Literal["linear"] = "linear"
    stiffness_n_per_mm: float = Field(ge=0.01, le=1000)

    def tissue(self) -> Tissue:
        """The tissue of this table."""
        return Spring(self.stiffness_n_per_mm)
