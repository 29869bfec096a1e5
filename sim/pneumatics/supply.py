"""Compressor, tank and regulator: the pressure that the inlet valve is fed with."""

from __future__ import annotations

from dataclasses import dataclass, field

from sim.pneumatics.settings import PneumaticSettings


@dataclass(slots=True)
class Supply:
    """Feeds the inlet valve. Pressures are above that of the room."""

    settings: PneumaticSettings
    regulator_kpa: float = field(init=False)
    shut: bool = False  #: the hand valve after the regulator
    compressor_works: bool = True
    tank_kpa: float = field(init=False)
    _compresses: bool = False
    _flow: float = 0.0  # [kPa·mm³/s] into the circuit during the last step

    def __post_init__(self) -> None:
        """A tank that has just been filled."""
        self.regulator_kpa = self.settings.regulator_kpa
        self.tank_kpa = self.settings.tank_high_kpa

    @property
    def outlet_kpa(self) -> float:
        """Pressure after the regulator: it droops under flow, and feels the tank a little."""
        own = self.settings
        swing_kpa = self.tank_kpa - 0.5 * (own.tank_low_kpa + own.tank_high_kpa)
        regulated_kpa = (
            self.regulator_kpa - own.supply_effect * swing_kpa - own.droop_kpa_s_per_kpa_mm3 * self._flow
        )
        return regulated_kpa if regulated_kpa < self.tank_kpa else self.tank_kpa

    def step(self, flow: float, dt_s: float) -> None:
        """Give `flow` [kPa·mm³/s at 20 °C] for `dt_s`; the compressor keeps the tank between its limits."""
        own = self.settings
        self._flow = flow
        if self.tank_kpa <= own.tank_low_kpa:
            self._compresses = True
        elif self.tank_kpa >= own.tank_high_kpa:
            self._compresses = False
        if self._compresses and self.compressor_works:
            flow -= own.compressor_kpa_mm3_per_s
        self.tank_kpa -= (flow / own.tank_mm3 + own.tank_leak_kpa_per_s) * dt_s
        if self.tank_kpa < 0:
            self.tank_kpa = 0.0
