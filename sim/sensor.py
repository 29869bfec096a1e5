"""The pressure sensor and its ADC: MPXV5050DP, 10 bits, sums of 16 conversions."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from instrument.rig.frames import OVERSAMPLING

#: V_out = V_s (0.018 P + 0.04), Freescale MPXV5050 data sheet, P in kPa.
SENSITIVITY_PER_KPA = 0.018
OFFSET = 0.04
RESPONSE_S = 0.001
LEVELS = 1024
NOISE_BLOCK = 500


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorSettings:
    """What this specimen is like."""

    zero_offset_kpa: float = 0.25
    noise_counts: float = 0.7  #: rms of one conversion


class Sensor:
    """Pressure at the sensor becomes an ADC sum."""

    def __init__(self, settings: SensorSettings, seed: int) -> None:
        self.settings = settings
        self._output_kpa = 0.0
        self._noise = _noise(settings.noise_counts, np.random.default_rng(seed))

    def adc_sum(self, pressure_kpa: float, dt_s: float) -> int:
        """Sum of 16 conversions, `dt_s` after the last; ratiometric, so the supply drops out."""
        self._output_kpa += (pressure_kpa - self._output_kpa) * -math.expm1(-dt_s / RESPONSE_S)
        ratio = SENSITIVITY_PER_KPA * (self._output_kpa + self.settings.zero_offset_kpa) + OFFSET
        level = LEVELS * ratio
        return sum([min(max(int(level + noise), 0), LEVELS - 1) for noise in next(self._noise)])


def _noise(rms: float, generator: np.random.Generator) -> Iterator[list[float]]:
    """Noise of 16 conversions at a time, for ever; drawn in blocks because that is ten times cheaper."""
    while True:
        yield from generator.normal(0.0, rms, (NOISE_BLOCK, OVERSAMPLING)).tolist()
