"""Conversion of ADC sums to a pressure, a filtered pressure and a rate of change."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

from pneuforce.protocol.frames import SAMPLES_PER_S
from pneuforce.protocol.limits import ZERO_SPAN_KPA, adc_sum_is_valid, nominal_pressure_kpa

#: Gains of the tracking filter (alpha-beta filter). The filter reduces noise threefold and follows a ramp
#: without lag.
POSITION_GAIN = 0.2
RATE_GAIN = 0.022
HISTORY_S = 0.1


@dataclass(slots=True)
class PressureReading:
    """Pressure that the board measures. While the sensor is invalid, the last valid values remain."""

    sensor_ok: bool = False  #: the sensor is neither open nor shorted
    pressure_kpa: float = 0.0  #: pressure of the last sample, minus the zero
    filtered_kpa: float = 0.0
    rate_kpa_per_s: float = 0.0
    unchanged_s: float = 0.0  #: time for which the ADC sum has been the same
    zero_kpa: float = 0.0
    zeroed: bool = False  #: `zero_kpa` is a valid zero from the host
    _adc_sum: int = -1
    _history_kpa: deque[float] = field(default_factory=lambda: deque(maxlen=round(HISTORY_S * SAMPLES_PER_S)))

    @property
    def past_kpa(self) -> float:
        """Return the pressure 100 ms ago [kPa]."""
        return self._history_kpa[0] if self._history_kpa else self.pressure_kpa

    def step(self, adc_sum: int, dt_s: float) -> None:
        """Add one sample."""
        self.unchanged_s = self.unchanged_s + dt_s if adc_sum == self._adc_sum else 0.0
        self._adc_sum = adc_sum
        self.sensor_ok = adc_sum_is_valid(adc_sum)
        if self.sensor_ok:
            self._update_filter(nominal_pressure_kpa(adc_sum) - self.zero_kpa, dt_s)

    def _update_filter(self, pressure_kpa: float, dt_s: float) -> None:
        if not self._history_kpa:
            self.filtered_kpa = pressure_kpa
        self.pressure_kpa = pressure_kpa
        self._history_kpa.append(pressure_kpa)
        predicted_kpa = self.filtered_kpa + self.rate_kpa_per_s * dt_s
        residual_kpa = pressure_kpa - predicted_kpa
        self.filtered_kpa = predicted_kpa + POSITION_GAIN * residual_kpa
        self.rate_kpa_per_s += RATE_GAIN * residual_kpa / dt_s

    def set_zero(self, zero_kpa: float, zeroed: bool) -> None:
        """Apply the zero of the host.

        A zero that exceeds the zero error of the data sheet is invalid and counts as missing.
        """
        zeroed = zeroed and -ZERO_SPAN_KPA <= zero_kpa <= ZERO_SPAN_KPA
        zero_kpa = zero_kpa if zeroed else 0.0
        self.pressure_kpa += self.zero_kpa - zero_kpa
        self.filtered_kpa += self.zero_kpa - zero_kpa
        if zero_kpa != self.zero_kpa:
            self._history_kpa.clear()
        self.zero_kpa, self.zeroed = zero_kpa, zeroed
