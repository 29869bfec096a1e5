"""The seam to the simulated world: what a balloon is, whatever law it obeys."""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

#: Volume of the paper's pipes [mm³] (Section IV-B), and the pressure of a standard day [kPa].
TUBES_MM3 = 12.68e3
AMBIENT_KPA = 101.325
#: The hardest push that a hand, a scenario or a tool can make [N]; balloons are known up to it.
HARDEST_N = 20.0


class Gas(NamedTuple):
    """The gas of the circuit, reckoned at the temperature that the gas in the balloon has."""

    amount_kpa_mm3: float  #: p·V of all of it [kPa·mm³], p absolute
    tubes_mm3: float = TUBES_MM3  #: volume outside the balloon [mm³]
    outside_kpa: float = AMBIENT_KPA  #: absolute pressure around the balloon [kPa]


class BalloonState(NamedTuple):
    """The balloon at one instant."""

    pressure_kpa: float  #: in the balloon, above the pressure around it [kPa]
    indentation_mm: float  #: how far it is pressed in [mm]
    contact_radius_mm: float  #: radius of the flat contact area [mm]
    volume_mm3: float  #: gas in the balloon, without the tubes [mm³]


class Plant(Protocol):
    """A balloon in equilibrium at every instant: no time, no valves, no sensor."""

    def radius_mm(self, pressure_kpa: float) -> float:
        """Radius [mm] of the free balloon at a pressure above that around it [kPa]."""
        ...

    def settle(self, gas: Gas, force_n: float) -> BalloonState:
        """The balloon that holds this gas under this force [N]: (p + outside)·(tubes + volume) = amount."""
        ...


def amount_kpa_mm3(
    plant: Plant, pressure_kpa: float, tubes_mm3: float = TUBES_MM3, outside_kpa: float = AMBIENT_KPA
) -> float:
    """Gas [kPa·mm³] in tubes and free balloon at a pressure above that around it [kPa]."""
    volume_mm3 = 4 / 3 * math.pi * plant.radius_mm(pressure_kpa) ** 3
    return (outside_kpa + pressure_kpa) * (tubes_mm3 + volume_mm3)
