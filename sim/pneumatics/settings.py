"""What the parts of the circuit are like, and what is still a circuit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from sim.plant import AMBIENT_KPA, TUBES_MM3


@dataclass(frozen=True, slots=True, kw_only=True)
class PneumaticSettings:
    """What a circuit is built of. Raises ValueError where a value is outside its span in `SPANS`.

    Conductances are those of ISO 6358 at 20 °C and 100 kPa. The inlet inflates at 4–6 kPa/s; the vent is four
    times as wide, so that both open leave less than 5 kPa.
    """

    # supply
    tank_mm3: float = 3e6
    tank_low_kpa: float = 400.0  #: the compressor starts
    tank_high_kpa: float = 600.0  #: and stops
    compressor_kpa_mm3_per_s: float = 1.7e7  #: 10 L/min of free air
    tank_leak_kpa_per_s: float = 0.02
    regulator_kpa: float = 50.0  #: without flow, the tank halfway between its limits
    droop_kpa_s_per_kpa_mm3: float = 1e-5  #: fall of the regulated pressure by flow
    supply_effect: float = 0.005  #: share of the tank's swing that comes through the regulator
    # valves
    inlet_mm3_per_s_kpa: float = 10.5
    vent_mm3_per_s_kpa: float = 44.0
    critical_ratio: float = 0.3
    relay_s: float = 0.005
    opening_s: float = 0.007
    closing_s: float = 0.007
    # tubes
    tubes_mm3: float = TUBES_MM3
    tube_s: float = 0.06  #: first-order lag from balloon to sensor
    leak_kpa_per_s: float = 0.0003  #: fall of the locked pressure at 8 kPa
    # gas
    polytropic: float = 1.0  #: 1 is isothermal, 1.4 adiabatic
    relaxation_s: float = 0.3  #: in which the walls take a temperature back
    balloon_warming_s: float = 20.0
    circuit_warming_s: float = 600.0
    # latex
    creep: float = 0.0  #: share by which the volume grows in the end, at 8 kPa
    creep_s: float = 60.0
    # surroundings
    ambient_kpa: float = AMBIENT_KPA
    ambient_drift_kpa_per_s: float = 0.0
    ambient_swing_kpa: float = 0.0
    ambient_swing_s: float = 600.0  #: one swing there and back
    reference_kpa: float = 0.0  #: of the body cavity, above the room: insufflation

    def __post_init__(self) -> None:
        """Hold every value against its span."""
        for name, (low, high) in SPANS.items():
            value = getattr(self, name)
            if not low <= value <= high:
                raise ValueError(f"{name} is {value:g}, and must be from {low:g} to {high:g}")
        if not self.tank_low_kpa < self.tank_high_kpa:
            raise ValueError("tank_low_kpa must be below tank_high_kpa")


_SHARE = (0.0, 1.0)
_TIME_S = (0.001, 1e5)
#: Spans of the settings, in their own units. Wide: what is outside is a slip of the pen.
SPANS: Mapping[str, tuple[float, float]] = {
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
    "tube_s": _TIME_S,
    "leak_kpa_per_s": (0.0, 10.0),
    "polytropic": (1.0, 1.4),
    "relaxation_s": _TIME_S,
    "balloon_warming_s": _TIME_S,
    "circuit_warming_s": _TIME_S,
    "creep": _SHARE,
    "creep_s": _TIME_S,
    "ambient_kpa": (50.0, 120.0),
    "ambient_drift_kpa_per_s": (-1.0, 1.0),
    "ambient_swing_kpa": (0.0, 10.0),
    "ambient_swing_s": (1.0, 1e5),
    "reference_kpa": (0.0, 5.0),
}
