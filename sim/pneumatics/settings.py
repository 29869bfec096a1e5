"""Settings of the pneumatic circuit, with their allowed ranges."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from pneuforce.sim.plants.plant import AMBIENT_KPA, TUBES_MM3


@dataclass(frozen=True, slots=True, kw_only=True)
class PneumaticSettings:
    """Properties of the parts of the circuit. Raises ValueError if a value is outside its range in `RANGES`.

    Conductances are those of ISO 6358 at 20 °C and 100 kPa. The inlet inflates at 4–6 kPa/s. The vent is four
    times as wide: if both valves are open, the pressure stays below 5 kPa.
    """

    # supply
    tank_mm3: float = 3e6
    tank_low_kpa: float = 400.0  #: the compressor starts at this pressure
    tank_high_kpa: float = 600.0  #: the compressor stops at this pressure
    compressor_kpa_mm3_per_s: float = 1.7e7  #: 10 L/min of free air
    tank_leak_kpa_per_s: float = 0.02
    #: Outlet pressure of the regulator without flow, if the tank pressure is halfway between its limits.
    regulator_kpa: float = 50.0
    droop_kpa_s_per_kpa_mm3: float = 1e-5  #: decrease of the outlet pressure per flow
    supply_effect: float = 0.005  #: decrease of the outlet pressure per increase of the tank pressure
    # valves
    inlet_mm3_per_s_kpa: float = 10.5
    vent_mm3_per_s_kpa: float = 44.0
    critical_ratio: float = 0.3
    relay_s: float = 0.005
    opening_s: float = 0.007
    closing_s: float = 0.007
    # tubes
    tubes_mm3: float = TUBES_MM3
    tube_time_constant_s: float = 0.06  #: time constant of the lag from balloon to sensor
    leak_kpa_per_s: float = 0.0003  #: fall of the pressure at 8 kPa with locked valves
    # gas
    polytropic: float = 1.0  #: polytropic exponent: 1 for isothermal, 1.4 for adiabatic changes
    relaxation_s: float = 0.3  #: time constant with which the walls absorb the heat of compression
    balloon_warming_s: float = 20.0  #: time constant of the temperature in the balloon
    circuit_warming_s: float = 600.0  #: time constant of the temperature in the tubes
    # latex
    creep: float = 0.0  #: final growth at 8 kPa, as a fraction of the volume
    creep_s: float = 60.0  #: time constant of the creep
    # surroundings
    ambient_kpa: float = AMBIENT_KPA
    ambient_drift_kpa_per_s: float = 0.0
    ambient_swing_kpa: float = 0.0
    ambient_swing_s: float = 600.0  #: period of the swing
    reference_kpa: float = 0.0  #: pressure of the insufflated body cavity, relative to the room

    def __post_init__(self) -> None:
        """Check every value against its range."""
        for name, (low, high) in RANGES.items():
            value = getattr(self, name)
            if not low <= value <= high:
                raise ValueError(f"{name} is {value:g}, and must be from {low:g} to {high:g}")
        if not self.tank_low_kpa < self.tank_high_kpa:
            raise ValueError("tank_low_kpa must be below tank_high_kpa")


_FRACTION = (0.0, 1.0)
_TIME_S = (0.001, 1e5)
#: Ranges of the settings, in the units of the settings. The ranges are wide: they reject typing errors only.
RANGES: Mapping[str, tuple[float, float]] = {
    "tank_mm3": (1e4, 1e9),
    "tank_low_kpa": (0.0, 1500.0),
    "tank_high_kpa": (0.0, 1500.0),
    "compressor_kpa_mm3_per_s": (0.0, 1e9),
    "tank_leak_kpa_per_s": (0.0, 100.0),
    "regulator_kpa": (0.0, 50.0),
    "droop_kpa_s_per_kpa_mm3": (0.0, 1e-4),
    "supply_effect": (0.0, 0.1),
    "inlet_mm3_per_s_kpa": (0.0, 1000.0),
    "vent_mm3_per_s_kpa": (0.0, 1000.0),
    "critical_ratio": (0.05, 0.6),
    "relay_s": (0.0, 1.0),
    "opening_s": (0.0, 1.0),
    "closing_s": (0.0, 1.0),
    "tubes_mm3": (1000.0, 1e6),
    "tube_time_constant_s": _TIME_S,
    "leak_kpa_per_s": (0.0, 10.0),
    "polytropic": (1.0, 1.4),
    "relaxation_s": _TIME_S,
    "balloon_warming_s": _TIME_S,
    "circuit_warming_s": _TIME_S,
    "creep": _FRACTION,
    "creep_s": _TIME_S,
    "ambient_kpa": (50.0, 120.0),
    "ambient_drift_kpa_per_s": (-1.0, 1.0),
    "ambient_swing_kpa": (0.0, 10.0),
    "ambient_swing_s": (1.0, 1e5),
    "reference_kpa": (0.0, 5.0),
}
