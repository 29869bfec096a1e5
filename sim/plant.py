"""The seam to the simulated world: what a balloon is, whatever law it obeys."""

from __future__ import annotations

from typing import NamedTuple, Protocol


class BalloonState(NamedTuple):
    """The balloon at one instant."""

    pressure_kpa: float  #: gauge pressure in the balloon [kPa]
    radius_mm: float  #: radius that the same gas would give it without contact [mm]
    indentation_mm: float  #: how far it is pressed in [mm]
    contact_radius_mm: float  #: radius of the flat contact area [mm]
    volume_mm3: float  #: gas in the balloon, without the tubes [mm³]


class Plant(Protocol):
    """A balloon and its tubes, in equilibrium at every instant; gas is counted as p·V, isothermal."""

    def gas_kpa_mm3(self, pressure_kpa: float) -> float:
        """Gas [kPa·mm³] in balloon and tubes at a gauge pressure [kPa], without contact."""
        ...

    def settle(self, gas_kpa_mm3: float, force_n: float) -> BalloonState:
        """The balloon that holds this gas [kPa·mm³] under this force [N]."""
        ...
