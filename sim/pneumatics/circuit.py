"""Pneumatic circuit over time: amount and temperature of the gas, and the pressure at the sensor."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from pneuforce.protocol.frames import Valve
from pneuforce.sim.plants.plant import BalloonState, Gas
from pneuforce.sim.pneumatics.ambient import Ambient
from pneuforce.sim.pneumatics.creep import Creep
from pneuforce.sim.pneumatics.flow import Orifice
from pneuforce.sim.pneumatics.settings import PneumaticSettings
from pneuforce.sim.pneumatics.supply import Supply
from pneuforce.sim.pneumatics.temperature import CompressionHeat, GasTemperature
from pneuforce.sim.pneumatics.valve import SolenoidValve

#: Gas that raises the pressure in the tubes and the free balloon of the paper by 1 kPa at 8 kPa [kPa·mm³].
CAPACITY_MM3 = 28_000.0
LEAK_REFERENCE_KPA = 8.0
#: Pressure across the shut inlet at which `Pneumatics.inlet_leak_kpa_per_s` is defined: a regulator outlet of
#: 50 kPa and a balloon at 8 kPa.
INLET_LEAK_REFERENCE_KPA = 42.0
#: Hole of a burst balloon, with 20 times the conductance of the vent. The flow is turbulent at all relevant
#: pressures.
HOLE = Orifice(880.0, 0.5, laminar_ratio=0.99)

_INLET_OPEN, _VENT_CLOSED = int(Valve.INLET_OPEN), int(Valve.VENT_CLOSED)


@dataclass(slots=True)
class Pneumatics:
    """Pneumatic circuit. Amounts of gas are converted to 20 °C.

    Faults write public attributes of the circuit and of its parts.
    """

    settings: PneumaticSettings
    gas_kpa_mm3: float  #: p·V of tubes and balloon; of the tubes alone while the balloon is occluded
    sensor_kpa: float = 0.0  #: pressure at the sensor, relative to the room
    powered_valves: int = Valve.NONE  #: `Valve` mask of the valves that are energized at the start
    leak_kpa_per_s: float = field(init=False)  #: fall of the pressure at 8 kPa with locked valves
    reference_kpa: float = field(init=False)  #: pressure around the balloon, relative to the room
    inlet_leak_kpa_per_s: float = 0.0  #: rise of the pressure at 8 kPa due to a leak of the shut inlet
    burst: bool = False  #: if True, the balloon has a wide hole
    occluded: bool = False  #: if True, no gas passes between balloon and tubes
    supply: Supply = field(init=False)
    inlet: SolenoidValve = field(init=False)
    vent: SolenoidValve = field(init=False)
    compression: CompressionHeat = field(init=False)
    balloon_temperature: GasTemperature = field(init=False)
    circuit_temperature: GasTemperature = field(init=False)
    creep: Creep = field(init=False)
    ambient: Ambient = field(init=False)
    _occluded_kpa_mm3: float | None = None  # gas in the occluded balloon

    def __post_init__(self) -> None:
        """Create the parts of the circuit from the settings."""
        settings = self.settings
        self.leak_kpa_per_s, self.reference_kpa = settings.leak_kpa_per_s, settings.reference_kpa
        self.supply = Supply(settings)
        self.inlet = self._valve(settings.inlet_mm3_per_s_kpa, bool(self.powered_valves & _INLET_OPEN))
        self.vent = self._valve(settings.vent_mm3_per_s_kpa, not self.powered_valves & _VENT_CLOSED)
        self.compression = CompressionHeat(settings.polytropic, settings.relaxation_s)
        self.balloon_temperature = GasTemperature(settings.balloon_warming_s)
        self.circuit_temperature = GasTemperature(settings.circuit_warming_s)
        self.creep = Creep(settings.creep, settings.creep_s)
        self.ambient = Ambient(
            settings.ambient_kpa,
            settings.ambient_drift_kpa_per_s,
            settings.ambient_swing_kpa,
            settings.ambient_swing_s,
        )

    def _valve(self, conductance_mm3_per_s_kpa: float, is_open: bool) -> SolenoidValve:
        settings = self.settings
        orifice = Orifice(conductance_mm3_per_s_kpa, settings.critical_ratio)
        opening_s, closing_s = settings.relay_s + settings.opening_s, settings.relay_s + settings.closing_s
        return SolenoidValve(orifice, opening_s, closing_s, is_open)

    @property
    def outside_kpa(self) -> float:
        """Return the absolute pressure around the balloon."""
        return self.ambient.kpa + self.reference_kpa

    @property
    def gas(self) -> Gas:
        """Return the gas at the temperature of the balloon, for the equilibrium of the plant.

        By creep, the volume of the balloon is 1 + growth times the volume that the plant computes. Therefore,
        gas and tube volume are divided by this factor, and the computed volume is multiplied by the factor.
        """
        balloon = self.balloon_temperature.ratio / (1 + self.creep.growth)
        heat = self.compression.ratio
        if self._occluded_kpa_mm3 is not None:
            return Gas(self._occluded_kpa_mm3 * balloon * heat, 0.0, self.outside_kpa)
        tubes_mm3 = self.settings.tubes_mm3 * balloon / self.circuit_temperature.ratio
        return Gas(self.gas_kpa_mm3 * balloon * heat, tubes_mm3, self.outside_kpa)

    def step(self, balloon: BalloonState, powered_valves: int, dt_s: float) -> None:
        """Advance the time by `dt_s` with the given state of the balloon and the given powered valves."""
        self.inlet.step(bool(powered_valves & _INLET_OPEN), dt_s)
        self.vent.step(not powered_valves & _VENT_CLOSED, dt_s)
        balloon_kpa = balloon.pressure_kpa + self.outside_kpa
        if self.occluded is (self._occluded_kpa_mm3 is None):
            self._separate_or_join(balloon, balloon_kpa)
        tubes_kpa = self._tubes_kpa(balloon_kpa)
        self._flow(tubes_kpa, balloon_kpa, dt_s)
        self.compression.step(balloon_kpa, dt_s)
        self.balloon_temperature.step(dt_s)
        self.circuit_temperature.step(dt_s)
        self.creep.step(balloon.pressure_kpa, dt_s)
        self.ambient.step(dt_s)
        lag_kpa = tubes_kpa - self.ambient.kpa - self.sensor_kpa
        self.sensor_kpa += lag_kpa * -math.expm1(-dt_s / self.settings.tube_time_constant_s)

    def _tubes_kpa(self, balloon_kpa: float) -> float:
        """Return the absolute pressure in the tubes."""
        if self._occluded_kpa_mm3 is None:
            return balloon_kpa
        temperature_ratio = self.circuit_temperature.ratio * self.compression.ratio
        return self.gas_kpa_mm3 * temperature_ratio / self.settings.tubes_mm3

    def _separate_or_join(self, balloon: BalloonState, balloon_kpa: float) -> None:
        if self._occluded_kpa_mm3 is None:
            volume_mm3 = balloon.volume_mm3 * (1 + self.creep.growth)
            temperature_ratio = self.balloon_temperature.ratio * self.compression.ratio
            self._occluded_kpa_mm3 = balloon_kpa * volume_mm3 / temperature_ratio
            self.gas_kpa_mm3 -= self._occluded_kpa_mm3
        else:
            self.gas_kpa_mm3 += self._occluded_kpa_mm3
            self._occluded_kpa_mm3 = None

    def _flow(self, tubes_kpa: float, balloon_kpa: float, dt_s: float) -> None:
        """Add the gas that flows in through the inlet. Subtract the outflow through vent, leak and hole."""
        room_kpa = self.ambient.kpa
        inflow = self._inflow(tubes_kpa, room_kpa)
        self.supply.step(inflow, dt_s)
        outflow = self.leak_kpa_per_s * CAPACITY_MM3 / LEAK_REFERENCE_KPA * (tubes_kpa - room_kpa)
        if self.vent.open:
            outflow += self.vent.orifice.flow(tubes_kpa, room_kpa)
        self.gas_kpa_mm3 += (inflow - outflow) * dt_s
        if self.burst:
            lost_kpa_mm3 = HOLE.flow(balloon_kpa, self.outside_kpa) * dt_s
            if self._occluded_kpa_mm3 is None:
                self.gas_kpa_mm3 -= lost_kpa_mm3
            else:
                self._occluded_kpa_mm3 -= lost_kpa_mm3

    def _inflow(self, tubes_kpa: float, room_kpa: float) -> float:
        """Return the flow through the inlet and its leak. No gas flows back through the regulator."""
        upstream_kpa = self.supply.outlet_kpa + room_kpa
        if self.supply.shut or not upstream_kpa > tubes_kpa:
            return 0.0
        leak_share = (upstream_kpa - tubes_kpa) / INLET_LEAK_REFERENCE_KPA
        leak = self.inlet_leak_kpa_per_s * CAPACITY_MM3 * leak_share
        return leak + (self.inlet.orifice.flow(upstream_kpa, tubes_kpa) if self.inlet.open else 0.0)
