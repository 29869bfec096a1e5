"""Interface of the simulated balloons, and the gas that a balloon shares with its tubes."""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

#: Volume of the pipes in the paper [mm³] (Section IV-B), and standard atmospheric pressure [kPa].
TUBES_MM3 = 12.68e3
AMBIENT_KPA = 101.325
#: Highest force of hand, scenarios and tools [N]. The simulated balloons are defined up to this force.
MAX_PUSH_N = 20.0


class Gas(NamedTuple):
    """Gas of the circuit, converted to the temperature of the gas in the balloon."""

    amount_kpa_mm3: float  #: p·V of all gas [kPa·mm³], with absolute p
    tubes_mm3: float = TUBES_MM3  #: volume outside the balloon [mm³]
    outside_kpa: float = AMBIENT_KPA  #: absolute pressure around the balloon [kPa]


class BalloonState(NamedTuple):
    """State of the balloon at one instant."""

    pressure_kpa: float  #: pressure in the balloon, relative to the pressure around the balloon [kPa]
    indentation_mm: float  #: indentation by the contact [mm]
    contact_radius_mm: float  #: radius of the flat contact area [mm]
    volume_mm3: float  #: volume of the gas in the balloon, without the tubes [mm³]


class Plant(Protocol):
    """Balloon in static equilibrium: without time, valves and sensor."""

    def radius_mm(self, pressure_kpa: float) -> float:
        """Return the radius [mm] of the free balloon at a pressure relative to its surroundings [kPa]."""
        ...

    def settle(self, gas: Gas, force_n: float) -> BalloonState:
        """Return the equilibrium with this gas under this force [N].

        The gas law holds: (p + outside)·(tubes + volume) = amount.
        """
        ...


def amount_kpa_mm3(
    plant: Plant, pressure_kpa: float, tubes_mm3: float = TUBES_MM3, outside_kpa: float = AMBIENT_KPA
) -> float:
    """Return the amount of gas [kPa·mm³] in tubes and free balloon at a gauge pressure [kPa]."""
    volume_mm3 = 4 / 3 * math.pi * plant.radius_mm(pressure_kpa) ** 3
    return (outside_kpa + pressure_kpa) * (tubes_mm3 + volume_mm3)
