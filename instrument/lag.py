"""What the pressure in the balloon is now: the lag of the tube undone, causally.

The balloon's pressure p moves with a rate v that wanders; the sensor's s follows it as s' = (p − s)/τ and is
read with noise. The stationary Kalman filter of that system gives p. It has no lag on a steady ramp; what it
costs is noise.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

#: One sample's noise [kPa]: (0.7² + 1/12)^½ counts, sixteen of them averaged.
NOISE_KPA = 0.0103
#: Wandering of the rate: by 17 kPa/s (rms) within a second, which is what hands do.
WANDER_KPA2_PER_S3 = 300.0
SAMPLE_S = 0.002
#: Lost samples up to this many are bridged; after a longer gap the filter begins anew.
MOST_STEPS = 10
#: No pressure moves that far from where it must be within a sample or two: a disturbed reading.
GLITCH_KPA = 0.5
MOST_GLITCHES = 2
#: The reading itself, with the noise taken off a little.
CALM_S = 0.02
#: A lead over the calm reading is believed by half where it is this many times the filter's noise.
BELIEVED = 2.0
#: A fast contact, by which the remaining delay is stated.
PRESS_S = 0.6


@dataclass(slots=True)
class LagCompensator:
    """Follows the pressure in the balloon through readings at the end of a tube."""

    tube_s: float
    calm_kpa: float = math.nan  #: the reading, smoothed over 20 ms: lags, with a noise of 2.4 Pa
    rate_kpa_per_s: float = 0.0
    noise_kpa: float = field(init=False)  #: standard deviation of the filter's pressure by noise alone
    delay_s: float = field(init=False)  #: by which it shows the peak of a press late
    _pressure_kpa: float = math.nan
    _sensor_kpa: float = math.nan
    _share: float = field(init=False)
    _drawn_s: float = field(init=False)
    _gains: list[list[float]] = field(init=False)  # by the samples that have passed, from 1
    _glitches: int = 0

    def __post_init__(self) -> None:
        self._share = -math.expm1(-SAMPLE_S / self.tube_s) if self.tube_s > 0 else 1.0
        self._drawn_s = SAMPLE_S - self.tube_s * self._share
        self._gains, self.noise_kpa = stationary(self._share, self._drawn_s)
        self.delay_s = self._delay_of_a_press_s()

    def step(self, reading_kpa: float, dt_s: float) -> float:
        """Pressure in the balloon [kPa] from a reading `dt_s` after the last; NaN begins anew."""
        steps = max(round(dt_s / SAMPLE_S), 1)
        if steps > MOST_STEPS or not math.isfinite(reading_kpa + self._sensor_kpa):
            return self._begin(reading_kpa)
        for _ in range(steps):
            self._sensor_kpa += self._share * (self._pressure_kpa - self._sensor_kpa)
            self._sensor_kpa += self._drawn_s * self.rate_kpa_per_s
            self._pressure_kpa += SAMPLE_S * self.rate_kpa_per_s
        surprise = reading_kpa - self._sensor_kpa
        if not -GLITCH_KPA <= surprise <= GLITCH_KPA and self._glitches < MOST_GLITCHES:
            self._glitches += 1
            return self._believed()
        self._glitches = 0
        self.calm_kpa += (reading_kpa - self.calm_kpa) * min(dt_s / CALM_S, 1.0)
        by_pressure, by_rate, by_sensor = self._gains[steps - 1]
        self._pressure_kpa += by_pressure * surprise
        self.rate_kpa_per_s += by_rate * surprise
        self._sensor_kpa += by_sensor * surprise
        return self._believed()

    def _begin(self, reading_kpa: float) -> float:
        self.calm_kpa = self._pressure_kpa = self._sensor_kpa = reading_kpa
        self.rate_kpa_per_s, self._glitches = 0.0, 0
        return reading_kpa

    def _believed(self) -> float:
        """The filter's pressure where it stands out of its noise; a lead within that is hardly believed."""
        lead_kpa = self._pressure_kpa - self.calm_kpa
        squared = lead_kpa * lead_kpa
        return self.calm_kpa + lead_kpa * squared / (squared + (BELIEVED * self.noise_kpa) ** 2)

    def _delay_of_a_press_s(self) -> float:
        """Delay of the peak [s] of a press that takes `PRESS_S`, tried out without noise."""
        sensor_kpa, shown = 0.0, []
        for n in range(round(PRESS_S / SAMPLE_S)):
            pressure_kpa = math.sin(math.pi * n * SAMPLE_S / PRESS_S) ** 2
            sensor_kpa += self._share * (pressure_kpa - sensor_kpa)
            shown.append(self.step(sensor_kpa, SAMPLE_S))
        self._begin(math.nan)
        late = max(range(len(shown)), key=shown.__getitem__) * SAMPLE_S - PRESS_S / 2
        return max(late, 0.0) + SAMPLE_S


def stationary(share: float, drawn_s: float) -> tuple[list[list[float]], float]:
    """Kalman gains of (p, v, s) for readings 1 to `MOST_STEPS` samples apart, once they have settled.

    And the noise that reaches p [kPa] where no sample is lost.
    """
    import numpy as np

    dt = SAMPLE_S
    move = np.array([[1, dt, 0], [0, 1, 0], [share, drawn_s, 1 - share]])
    wander = WANDER_KPA2_PER_S3 * np.array([[dt**3 / 3, dt**2 / 2, 0], [dt**2 / 2, dt, 0], [0, 0, 0]])
    moves, wanders = [move], [wander]
    for _ in range(MOST_STEPS - 1):
        wanders.append(move @ wanders[-1] @ move.T + wander)
        moves.append(move @ moves[-1])
    far, wandered = np.array(moves), np.array(wanders)
    spread = np.broadcast_to(np.diag([1.0, 100.0, 1.0]), far.shape)
    for _ in range(600):
        ahead = far @ spread @ far.transpose(0, 2, 1) + wandered
        gains = ahead[:, :, 2] / (ahead[:, 2, 2] + NOISE_KPA**2)[:, None]
        spread = ahead - gains[:, :, None] * ahead[:, None, 2, :]
    follow = (np.eye(3) - np.outer(gains[0], [0.0, 0.0, 1.0])) @ move
    by_noise = np.outer(gains[0], gains[0]) * NOISE_KPA**2
    for _ in range(14):  # the sum over all past samples, doubled each time
        by_noise, follow = by_noise + follow @ by_noise @ follow.T, follow @ follow
    return gains.tolist(), math.sqrt(by_noise[0, 0])
