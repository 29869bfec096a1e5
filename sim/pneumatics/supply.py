"""Gas supply: compressor, tank and regulator upstream of the inlet valve."""

from __future__ import annotations

from dataclasses import dataclass, field

from pneuforce.sim.pneumatics.settings import PneumaticSettings


@dataclass(slots=True)
class Supply:
    """Gas supply of the inlet valve. Pressures are relative to the room."""

    settings: PneumaticSettings
    regulator_kpa: float = field(init=False)
    shut: bool = False  #: if True, the manual valve after the regulator is closed
    compressor_works: bool = True
    tank_kpa: float = field(init=False)
    _compressing: bool = False
    _flow: float = 0.0  # flow into the circuit during the last step [kPa·mm³/s]

    def __post_init__(self) -> None:
        """Start with a full tank."""
        self.regulator_kpa = self.settings.regulator_kpa
        self.tank_kpa = self.settings.tank_high_kpa

    @property
    def outlet_kpa(self) -> float:
        """Return the outlet pressure of the regulator. It falls when the flow or the tank pressure rises."""
        settings = self.settings
        swing_kpa = self.tank_kpa - 0.5 * (settings.tank_low_kpa + settings.tank_high_kpa)
        regulated_kpa = (
            self.regulator_kpa
            - settings.supply_effect * swing_kpa
            - settings.droop_kpa_s_per_kpa_mm3 * self._flow
        )
        return regulated_kpa if regulated_kpa < self.tank_kpa else self.tank_kpa

    def step(self, flow: float, dt_s: float) -> None:
        """Deliver `flow` [kPa·mm³/s at 20 °C] for `dt_s`. The compressor refills the tank."""
        settings = self.settings
        self._flow = flow
        if self.tank_kpa <= settings.tank_low_kpa:
            self._compressing = True
        elif self.tank_kpa >= settings.tank_high_kpa:
            self._compressing = False
        if self._compressing and self.compressor_works:
            flow -= settings.compressor_kpa_mm3_per_s
        self.tank_kpa -= (flow / settings.tank_mm3 + settings.tank_leak_kpa_per_s) * dt_s
        if self.tank_kpa < 0:
            self.tank_kpa = 0.0
