"""Gas through valves: supply, inlet, vent, leak, and the tube to the sensor."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field

from instrument.rig.frames import Valve

#: Gas [kPa·mm³] that raises the paper's free balloon and tubes by 1 kPa at 8 kPa.
CAPACITY_MM3 = 28_000.0
LEAK_REFERENCE_KPA = 8.0


@dataclass(frozen=True, slots=True, kw_only=True)
class PneumaticSettings:
    """What the parts of the circuit are like.

    The orifices pass k·√Δp [kPa·mm³/s]. The inlet's inflates at 4–6 kPa/s; the vent's is four times as wide,
    so that both open leave less than 5 kPa.
    """

    supply_kpa: float = 50.0
    inlet: float = 19_000.0
    vent: float = 76_000.0
    leak_kpa_per_s: float = 0.0003  #: fall of the locked pressure at 8 kPa
    valve_delay_s: float = 0.012
    tube_s: float = 0.06  #: first-order lag from balloon to sensor


@dataclass(slots=True)
class Pneumatics:
    """The gas in the circuit, and the pressure that reaches the sensor."""

    settings: PneumaticSettings
    gas_kpa_mm3: float
    sensor_kpa: float = 0.0
    valves: int = Valve.NONE  #: where the valves are, `valve_delay_s` after they were told
    _told: deque[tuple[float, int]] = field(default_factory=deque)  # (time left [s], valves)

    def step(self, balloon_kpa: float, told: int, dt_s: float) -> None:
        """Let gas flow for `dt_s` with the balloon at `balloon_kpa` and the valves told to be `told`."""
        self._move_valves(told, dt_s)
        self.gas_kpa_mm3 += self._flow(balloon_kpa) * dt_s
        self.sensor_kpa += (balloon_kpa - self.sensor_kpa) * -math.expm1(-dt_s / self.settings.tube_s)

    def _move_valves(self, told: int, dt_s: float) -> None:
        if told != (self._told[-1][1] if self._told else self.valves):
            self._told.append((self.settings.valve_delay_s, told))
        if self._told:
            self._told = deque((left_s - dt_s, valves) for left_s, valves in self._told)
            while self._told and self._told[0][0] <= 0:
                self.valves = self._told.popleft()[1]

    def _flow(self, balloon_kpa: float) -> float:
        """Net gas into the circuit [kPa·mm³/s]."""
        own = self.settings
        flow = -own.leak_kpa_per_s * CAPACITY_MM3 / LEAK_REFERENCE_KPA * balloon_kpa
        if self.valves & Valve.INLET_OPEN:
            flow += own.inlet * _root(own.supply_kpa - balloon_kpa)
        if not self.valves & Valve.VENT_CLOSED:
            flow -= own.vent * _root(balloon_kpa)
        return flow


def _root(drop_kpa: float) -> float:
    """√Δp with its sign, straight near zero, where the flow is laminar and a root would chatter."""
    return drop_kpa / math.sqrt(abs(drop_kpa) + 0.05)
