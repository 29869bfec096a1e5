"""From ADC sums to a pressure, its smooth course and its rate."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

from instrument.rig.frames import SAMPLES_PER_S
from instrument.rig.limits import ZERO_SPAN_KPA, alive, nominal_pressure_kpa

#: Gains of the tracking filter: noise is damped threefold, a ramp is followed without lag.
POSITION_GAIN = 0.2
RATE_GAIN = 0.022
PAST_S = 0.1


@dataclass(slots=True)
class Reading:
    """What the board knows of the pressure. Where the sensor is not alive it keeps its last value."""

    alive: bool = False
    pressure_kpa: float = 0.0  #: as sampled, less the zero
    smooth_kpa: float = 0.0
    rate_kpa_per_s: float = 0.0
    unmoved_s: float = 0.0  #: for how long the ADC sum has been the same
    zero_kpa: float = 0.0
    zeroed: bool = False
    _adc_sum: int = -1
    _past: deque[float] = field(default_factory=lambda: deque(maxlen=round(PAST_S * SAMPLES_PER_S)))

    @property
    def before_kpa(self) -> float:
        """Pressure 100 ms ago [kPa]."""
        return self._past[0] if self._past else self.pressure_kpa

    def step(self, adc_sum: int, dt_s: float) -> None:
        """One sample later."""
        self.unmoved_s = self.unmoved_s + dt_s if adc_sum == self._adc_sum else 0.0
        self._adc_sum = adc_sum
        self.alive = alive(adc_sum)
        if self.alive:
            self._follow(nominal_pressure_kpa(adc_sum) - self.zero_kpa, dt_s)

    def _follow(self, pressure_kpa: float, dt_s: float) -> None:
        if not self._past:
            self.smooth_kpa = pressure_kpa
        self.pressure_kpa = pressure_kpa
        self._past.append(pressure_kpa)
        expected_kpa = self.smooth_kpa + self.rate_kpa_per_s * dt_s
        surprise_kpa = pressure_kpa - expected_kpa
        self.smooth_kpa = expected_kpa + POSITION_GAIN * surprise_kpa
        self.rate_kpa_per_s += RATE_GAIN * surprise_kpa / dt_s

    def set_zero(self, zero_kpa: float, zeroed: bool) -> None:
        """Take over the host's zero; one beyond the data sheet's span is none."""
        zeroed = zeroed and -ZERO_SPAN_KPA <= zero_kpa <= ZERO_SPAN_KPA
        zero_kpa = zero_kpa if zeroed else 0.0
        self.pressure_kpa += self.zero_kpa - zero_kpa
        self.smooth_kpa += self.zero_kpa - zero_kpa
        if zero_kpa != self.zero_kpa:
            self._past.clear()
        self.zero_kpa, self.zeroed = zero_kpa, zeroed
