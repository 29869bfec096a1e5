"""The circuit in time: how much gas is where, how warm it is, and the pressure that reaches the sensor."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from instrument.rig.frames import Valve
from sim.plant import BalloonState, Gas
from sim.pneumatics.ambient import Ambient
from sim.pneumatics.creep import Creep
from sim.pneumatics.flow import Orifice
from sim.pneumatics.settings import PneumaticSettings
from sim.pneumatics.supply import Supply
from sim.pneumatics.valve import SolenoidValve
from sim.pneumatics.warmth import Compression, Warmth

#: Gas [kPa·mm³] that raises the paper's free balloon and tubes by 1 kPa at 8 kPa.
CAPACITY_MM3 = 28_000.0
LEAK_REFERENCE_KPA = 8.0
#: A burst balloon: twenty vents. Turbulent wherever that matters.
HOLE = Orifice(880.0, 0.5, laminar_ratio=0.99)

_INLET_OPEN, _VENT_CLOSED = int(Valve.INLET_OPEN), int(Valve.VENT_CLOSED)


@dataclass(slots=True)
class Pneumatics:
    """The gas in the circuit, counted at 20 °C. What a fault changes is a plain attribute."""

    settings: PneumaticSettings
    gas_kpa_mm3: float  #: p·V of tubes and balloon; of the tubes alone while the two are apart
    sensor_kpa: float = 0.0  #: above that of the room
    told: int = Valve.NONE  #: mask of the valves that are energised
    leak_kpa_per_s: float = field(init=False)  #: fall of the locked pressure at 8 kPa
    reference_kpa: float = field(init=False)  #: pressure around the balloon, above that of the room
    burst: bool = False  #: a wide hole in the balloon
    occluded: bool = False  #: nothing passes between balloon and tubes
    supply: Supply = field(init=False)
    inlet: SolenoidValve = field(init=False)
    vent: SolenoidValve = field(init=False)
    compression: Compression = field(init=False)
    balloon_warmth: Warmth = field(init=False)
    circuit_warmth: Warmth = field(init=False)
    creep: Creep = field(init=False)
    ambient: Ambient = field(init=False)
    _kept_kpa_mm3: float | None = None  # in the balloon while it is apart

    def __post_init__(self) -> None:
        """Build the parts as the settings say."""
        own = self.settings
        self.leak_kpa_per_s, self.reference_kpa = own.leak_kpa_per_s, own.reference_kpa
        self.supply = Supply(own)
        self.inlet = self._valve(own.inlet_mm3_per_s_kpa, bool(self.told & _INLET_OPEN))
        self.vent = self._valve(own.vent_mm3_per_s_kpa, not self.told & _VENT_CLOSED)
        self.compression = Compression(own.polytropic, own.relaxation_s)
        self.balloon_warmth = Warmth(own.balloon_warming_s)
        self.circuit_warmth = Warmth(own.circuit_warming_s)
        self.creep = Creep(own.creep, own.creep_s)
        self.ambient = Ambient(
            own.ambient_kpa, own.ambient_drift_kpa_per_s, own.ambient_swing_kpa, own.ambient_swing_s
        )

    def _valve(self, conductance_mm3_per_s_kpa: float, is_open: bool) -> SolenoidValve:
        own = self.settings
        orifice = Orifice(conductance_mm3_per_s_kpa, own.critical_ratio)
        return SolenoidValve(orifice, own.relay_s + own.opening_s, own.relay_s + own.closing_s, is_open)

    @property
    def outside_kpa(self) -> float:
        """Absolute pressure around the balloon."""
        return self.ambient.kpa + self.reference_kpa

    @property
    def gas(self) -> Gas:
        """The gas that the balloon shares. Creep divides it, and multiplies the volume that is found."""
        balloon = self.balloon_warmth.ratio / (1 + self.creep.growth)
        heat = self.compression.ratio
        if self._kept_kpa_mm3 is not None:
            return Gas(self._kept_kpa_mm3 * balloon * heat, 0.0, self.outside_kpa)
        tubes_mm3 = self.settings.tubes_mm3 * balloon / self.circuit_warmth.ratio
        return Gas(self.gas_kpa_mm3 * balloon * heat, tubes_mm3, self.outside_kpa)

    def step(self, balloon: BalloonState, told: int, dt_s: float) -> None:
        """Let gas flow for `dt_s`, the balloon being as it is and the valves told to be `told`."""
        self.inlet.step(bool(told & _INLET_OPEN), dt_s)
        self.vent.step(not told & _VENT_CLOSED, dt_s)
        balloon_kpa = balloon.pressure_kpa + self.outside_kpa
        if self.occluded is (self._kept_kpa_mm3 is None):
            self._part_or_join(balloon, balloon_kpa)
        tubes_kpa = self._tubes_kpa(balloon_kpa)
        self._flow(tubes_kpa, balloon_kpa, dt_s)
        self.compression.step(balloon_kpa, dt_s)
        self.balloon_warmth.step(dt_s)
        self.circuit_warmth.step(dt_s)
        self.creep.step(balloon.pressure_kpa, dt_s)
        self.ambient.step(dt_s)
        lagging_kpa = tubes_kpa - self.ambient.kpa - self.sensor_kpa
        self.sensor_kpa += lagging_kpa * -math.expm1(-dt_s / self.settings.tube_s)

    def _tubes_kpa(self, balloon_kpa: float) -> float:
        """Absolute pressure in the tubes."""
        if self._kept_kpa_mm3 is None:
            return balloon_kpa
        warm = self.circuit_warmth.ratio * self.compression.ratio
        return self.gas_kpa_mm3 * warm / self.settings.tubes_mm3

    def _part_or_join(self, balloon: BalloonState, balloon_kpa: float) -> None:
        if self._kept_kpa_mm3 is None:
            volume_mm3 = balloon.volume_mm3 * (1 + self.creep.growth)
            warm = self.balloon_warmth.ratio * self.compression.ratio
            self._kept_kpa_mm3 = balloon_kpa * volume_mm3 / warm
            self.gas_kpa_mm3 -= self._kept_kpa_mm3
        else:
            self.gas_kpa_mm3 += self._kept_kpa_mm3
            self._kept_kpa_mm3 = None

    def _flow(self, tubes_kpa: float, balloon_kpa: float, dt_s: float) -> None:
        """Gas through inlet, vent, leak and hole."""
        room_kpa = self.ambient.kpa
        inflow = self._inflow(tubes_kpa, room_kpa)
        self.supply.step(inflow, dt_s)
        outflow = self.leak_kpa_per_s * CAPACITY_MM3 / LEAK_REFERENCE_KPA * (tubes_kpa - room_kpa)
        if self.vent.open:
            outflow += self.vent.orifice.flow(tubes_kpa, room_kpa)
        self.gas_kpa_mm3 += (inflow - outflow) * dt_s
        if self.burst:
            lost_kpa_mm3 = HOLE.flow(balloon_kpa, self.outside_kpa) * dt_s
            if self._kept_kpa_mm3 is None:
                self.gas_kpa_mm3 -= lost_kpa_mm3
            else:
                self._kept_kpa_mm3 -= lost_kpa_mm3

    def _inflow(self, tubes_kpa: float, room_kpa: float) -> float:
        """Through the inlet; the regulator lets nothing back."""
        if not self.inlet.open or self.supply.shut:
            return 0.0
        upstream_kpa = self.supply.outlet_kpa + room_kpa
        return self.inlet.orifice.flow(upstream_kpa, tubes_kpa) if upstream_kpa > tubes_kpa else 0.0
