"""Pressure sensor and analog-to-digital converter: MPXV5050DP, 10 bits, sums of 16 conversions."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from pneuforce.protocol.frames import OVERSAMPLING
from pneuforce.protocol.limits import OFFSET, SENSITIVITY_PER_KPA

RESPONSE_S = 0.001
SPAN_KPA = 50.0
#: Accuracy of the data sheet from 0 to 85 °C: ±2.5 % of the full-scale span.
ERROR_BAND_KPA = 0.025 * SPAN_KPA
LEVELS = 1024
NOISE_BLOCK = 500
#: The noise is limited to this multiple of its rms. Therefore, noise cannot overdrive the ADC if the level is
#: farther than this from both ends of the ADC range.
MAX_NOISE_RMS = 6.0
#: Frequency of the supply ripple: twice the mains frequency, aliased by the sampling.
RIPPLE_HZ = 100.3

_Noise = tuple[int, list[float], np.ndarray]


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorSettings:
    """Properties of one sensor. Raises ValueError if the properties violate the data sheet."""

    zero_offset_kpa: float = 0.25
    gain_error: float = 0.0  #: error proportional to the pressure, as a fraction of the pressure
    bow_kpa: float = 0.0  #: nonlinearity: deviation from the straight line in the middle of the span
    noise_counts: float = 0.7  #: rms noise of one conversion
    ripple_mv: float = 0.0  #: amplitude of the supply ripple; the ratiometric ADC cancels the ripple

    def __post_init__(self) -> None:
        """Check the error against the data sheet, and noise and ripple against their ranges."""
        worst_kpa = max(abs(self.error_kpa(float(kpa))) for kpa in range(round(SPAN_KPA) + 1))
        if not worst_kpa <= ERROR_BAND_KPA:
            size = f"{worst_kpa:.2f} kPa" if math.isfinite(worst_kpa) else "unlimited size"
            raise ValueError(
                f"zero_offset_kpa, gain_error and bow_kpa cause an error of {size}; the data sheet of the "
                f"sensor allows {ERROR_BAND_KPA:g} kPa"
            )
        if not 0 <= self.noise_counts <= 20:
            raise ValueError(f"noise_counts is {self.noise_counts:g}, and must be from 0 to 20")
        if not 0 <= self.ripple_mv <= 500:
            raise ValueError(f"ripple_mv is {self.ripple_mv:g}, and must be from 0 to 500")

    def error_kpa(self, pressure_kpa: float) -> float:
        """Return the error of the sensor [kPa] at a pressure [kPa]."""
        fraction = pressure_kpa / SPAN_KPA
        return (
            self.zero_offset_kpa
            + self.gain_error * pressure_kpa
            + 4 * self.bow_kpa * fraction * (1 - fraction)
        )


class Sensor:
    """Pressure sensor with ADC, which converts a pressure to an ADC sum. Faults write public attributes."""

    def __init__(self, settings: SensorSettings, seed: int) -> None:
        self.settings = settings
        self.stuck_at: int | None = None  #: constant sum of an open (full scale) or shorted (0) sensor
        self.frozen = False  #: if True, the last sum is repeated
        self.drift_kpa = 0.0
        self._output_kpa = 0.0
        self._sum = 0
        self._margin = MAX_NOISE_RMS * settings.noise_counts
        self._noise = _noise(settings.noise_counts, np.random.default_rng(seed))

    def adc_sum(self, pressure_kpa: float, dt_s: float) -> int:
        """Return the sum of 16 conversions, `dt_s` after the last sum.

        The measurement is ratiometric: it does not depend on the supply voltage.
        """
        self._output_kpa += (pressure_kpa - self._output_kpa) * -math.expm1(-dt_s / RESPONSE_S)
        output_kpa = self._output_kpa + self.settings.error_kpa(self._output_kpa) + self.drift_kpa
        level = LEVELS * (SENSITIVITY_PER_KPA * output_kpa + OFFSET)
        drawn = next(self._noise)
        if not self.frozen:
            self._sum = self._converted(level, drawn)
        return self._sum if self.stuck_at is None else self.stuck_at

    def _converted(self, level: float, drawn: _Noise) -> int:
        """Return Σ⌊level + noiseᵢ⌋.

        The integer parts are added. A conversion gains one count if the fractions of its noise and of the
        level together reach 1; bisection in the sorted fractions counts these conversions.
        """
        integers, fractions, noise = drawn
        if not self._margin <= level < LEVELS - self._margin:
            return _clipped_sum(level, noise)
        count = int(level)
        carried = OVERSAMPLING - bisect_left(fractions, 1 - (level - count))
        return OVERSAMPLING * count + integers + carried

    def ripple_mv(self, t_s: float) -> int:
        """Return the deviation of the supply voltage from its mean at the time `t_s` [mV]."""
        amplitude_mv = self.settings.ripple_mv
        return round(amplitude_mv * math.sin(2 * math.pi * RIPPLE_HZ * t_s)) if amplitude_mv else 0


def _clipped_sum(level: float, noise: np.ndarray) -> int:
    """Return the sum of the conversions, each limited to the ADC range."""
    return int(np.floor(level + noise).clip(0, LEVELS - 1).sum())


def _noise(rms: float, generator: np.random.Generator) -> Iterator[_Noise]:
    """Yield the noise of 16 conversions: sum of the integer parts, sorted fractions, and the noise itself.

    Random numbers are drawn in blocks, because that is ten times faster.
    """
    while True:
        noise = generator.normal(0.0, rms, (NOISE_BLOCK, OVERSAMPLING)).clip(
            -MAX_NOISE_RMS * rms, MAX_NOISE_RMS * rms
        )
        integers = np.floor(noise)
        fractions = np.sort(noise - integers, axis=1)
        yield from zip(integers.sum(axis=1).astype(int).tolist(), fractions.tolist(), noise, strict=True)
