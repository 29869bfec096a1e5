"""The pressure sensor and its ADC: MPXV5050DP, 10 bits, sums of 16 conversions."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from instrument.rig.frames import OVERSAMPLING
from instrument.rig.limits import OFFSET, SENSITIVITY_PER_KPA

RESPONSE_S = 0.001
SPAN_KPA = 50.0
#: What the data sheet allows between 0 and 85 °C: ±2.5 % of the full-scale span.
ERROR_BAND_KPA = 0.025 * SPAN_KPA
LEVELS = 1024
NOISE_BLOCK = 500
#: Noise is cut off here [rms], so that beyond it from a rail no conversion can reach that rail.
MOST_NOISE = 6.0
#: Twice the mains, folded by sampling.
RIPPLE_HZ = 100.3

_Noise = tuple[int, list[float], np.ndarray]


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorSettings:
    """What this specimen is like. Raises ValueError where the data sheet knows no such specimen."""

    zero_offset_kpa: float = 0.25
    gain_error: float = 0.0  #: share of the pressure
    bow_kpa: float = 0.0  #: error in the middle of the span, over the straight line
    noise_counts: float = 0.7  #: rms of one conversion
    ripple_mv: float = 0.0  #: amplitude, of the supply; the ADC shares it, so it drops out of the sum

    def __post_init__(self) -> None:
        """Hold the error against the data sheet's band."""
        worst_kpa = max(abs(self.error_kpa(float(kpa))) for kpa in range(round(SPAN_KPA) + 1))
        if not worst_kpa <= ERROR_BAND_KPA:
            size = f"{worst_kpa:.2f} kPa" if math.isfinite(worst_kpa) else "no size that could be told"
            raise ValueError(
                f"offset, gain and bow make an error of {size}; the data sheet allows {ERROR_BAND_KPA:g} kPa"
            )
        if not 0 <= self.noise_counts <= 20:
            raise ValueError(f"noise_counts is {self.noise_counts:g}, and must be from 0 to 20")
        if not 0 <= self.ripple_mv <= 500:
            raise ValueError(f"ripple_mv is {self.ripple_mv:g}, and must be from 0 to 500")

    def error_kpa(self, pressure_kpa: float) -> float:
        """Error [kPa] at a pressure [kPa]."""
        share = pressure_kpa / SPAN_KPA
        return self.zero_offset_kpa + self.gain_error * pressure_kpa + 4 * self.bow_kpa * share * (1 - share)


class Sensor:
    """Pressure at the sensor becomes an ADC sum. What a fault changes is a plain attribute."""

    def __init__(self, settings: SensorSettings, seed: int) -> None:
        self.settings = settings
        self.stuck_at: int | None = None  #: sum that an open (full scale) or short (0) sensor gives
        self.frozen = False  #: repeats the last sum
        self.drift_kpa = 0.0
        self._output_kpa = 0.0
        self._sum = 0
        self._margin = MOST_NOISE * settings.noise_counts
        self._noise = _noise(settings.noise_counts, np.random.default_rng(seed))

    def adc_sum(self, pressure_kpa: float, dt_s: float) -> int:
        """Sum of 16 conversions, `dt_s` after the last; ratiometric, so the supply drops out."""
        self._output_kpa += (pressure_kpa - self._output_kpa) * -math.expm1(-dt_s / RESPONSE_S)
        output_kpa = self._output_kpa + self.settings.error_kpa(self._output_kpa) + self.drift_kpa
        level = LEVELS * (SENSITIVITY_PER_KPA * output_kpa + OFFSET)
        drawn = next(self._noise)
        if not self.frozen:
            self._sum = self._converted(level, drawn)
        return self._sum if self.stuck_at is None else self.stuck_at

    def _converted(self, level: float, drawn: _Noise) -> int:
        """Σ⌊level + noiseᵢ⌋: whole parts add up, and a fraction carries where it fills that of the level."""
        whole, fractions, noise = drawn
        if not self._margin <= level < LEVELS - self._margin:
            return _railed(level, noise)
        count = int(level)
        carried = OVERSAMPLING - bisect_left(fractions, 1 - (level - count))
        return OVERSAMPLING * count + whole + carried

    def ripple_mv(self, t_s: float) -> int:
        """How far the supply is from its mean."""
        amplitude_mv = self.settings.ripple_mv
        return round(amplitude_mv * math.sin(2 * math.pi * RIPPLE_HZ * t_s)) if amplitude_mv else 0


def _railed(level: float, noise: np.ndarray) -> int:
    """Conversions that may reach a rail, one by one."""
    return int(np.floor(level + noise).clip(0, LEVELS - 1).sum())


def _noise(rms: float, generator: np.random.Generator) -> Iterator[_Noise]:
    """Noise of 16 conversions at a time, for ever: sum of the whole parts, sorted fractions, and itself.

    It is drawn in blocks because that is ten times cheaper.
    """
    while True:
        noise = generator.normal(0.0, rms, (NOISE_BLOCK, OVERSAMPLING)).clip(
            -MOST_NOISE * rms, MOST_NOISE * rms
        )
        whole = np.floor(noise)
        fractions = np.sort(noise - whole, axis=1)
        yield from zip(whole.sum(axis=1).astype(int).tolist(), fractions.tolist(), noise, strict=True)
