"""The seam to the simulated world: what a balloon is, whatever law it obeys."""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

#: Volume of the paper's pipes [mm³] (Section IV-B), and the pressure of a standard day [kPa].
TUBES_MM3 = 12.68e3
AMBIENT_KPA = 101.325
#: A push that no balloon withstands [N], and how close `force_at` comes to an indentation [mm].
HARDEST_N, FINEST_MM = 50.0, 1e-6


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


def force_at(plant: Plant, gas: Gas, indentation_mm: float) -> float:
    """Force [N] that presses a balloon with this gas in so far; 50 N where none does.

    By the Illinois rule on √force, over which indentation is nearly straight.
    """
    if not indentation_mm > 0:
        return 0.0
    low, high, stayed = 0.0, math.sqrt(HARDEST_N), 0
    low_mm, high_mm = -indentation_mm, plant.settle(gas, HARDEST_N).indentation_mm - indentation_mm
    if high_mm <= 0:
        return HARDEST_N
    for _ in range(60):
        root = high - high_mm * (high - low) / (high_mm - low_mm)
        missing_mm = plant.settle(gas, root * root).indentation_mm - indentation_mm
        if abs(missing_mm) < FINEST_MM:
            break
        if missing_mm < 0:
            high_mm *= 0.5 if stayed < 0 else 1.0
            low, low_mm, stayed = root, missing_mm, -1
        else:
            low_mm *= 0.5 if stayed > 0 else 1.0
            high, high_mm, stayed = root, missing_mm, 1
    return root * root
