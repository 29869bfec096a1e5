"""Lag compensation: the present pressure in the balloon, from readings at the end of a tube.

The state of the system has three variables: the pressure p in the balloon, its rate v (a random walk), and
the pressure s at the sensor. s follows s' = (p − s)/τ and is read with noise. The stationary Kalman filter of
this system estimates p from past readings only. The estimate has no lag on a steady ramp, but more noise than
the readings.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import lru_cache

#: Standard deviation of the noise of one sample [kPa]. A sample is the mean of 16 conversions, each with a
#: noise of (0.7² + 1/12)^½ counts.
MEASUREMENT_NOISE_KPA = 0.0103
#: Process noise: spectral density of the random walk of the rate. A hand changes the rate by 17 kPa/s (rms)
#: within a second.
PROCESS_NOISE_KPA2_PER_S3 = 300.0
SAMPLE_S = 0.002
#: The filter predicts across a gap of at most this number of sample periods. After a longer gap, it restarts.
MAX_BRIDGED_SAMPLES = 10
#: A reading that differs from the prediction by more than this is an outlier [kPa]. No real pressure changes
#: so much within two samples.
OUTLIER_KPA = 0.5
#: Highest number of consecutive outliers that the filter ignores. The filter uses the next outlier like a
#: normal reading.
MAX_OUTLIERS = 2
#: Time constant of the smoothed reading, which has less noise than the reading.
SMOOTHING_TIME_CONSTANT_S = 0.02
#: The lead is the filtered pressure minus the smoothed reading. A lead of this number of standard deviations
#: of the filter noise is halved.
SHRINKAGE_STDS = 2.0
#: Noise of the compensated pressure at rest, as a share of the noise of the filter.
REST_NOISE_SHARE = 0.4
#: Duration of a simulated fast press, from which the remaining delay of the filter is determined.
REFERENCE_PRESS_S = 0.6


@dataclass(slots=True)
class LagCompensator:
    """Stationary Kalman filter for the pressure in the balloon."""

    tube_time_constant_s: float
    smoothed_kpa: float = math.nan  #: reading smoothed over 20 ms, with lag and with a noise of 2.4 Pa
    rate_kpa_per_s: float = 0.0
    noise_kpa: float = field(init=False)  #: standard deviation of the filtered pressure due to noise
    delay_s: float = field(init=False)  #: delay of a pressure peak that remains after the filter
    _pressure_kpa: float = math.nan
    _sensor_kpa: float = math.nan
    _response: float = field(init=False)  # change of s in one sample, per unit of p − s
    _rate_response_s: float = field(init=False)  # change of s in one sample, per unit of v
    _gains: list[list[float]] = field(init=False)  # Kalman gains; the index is the gap in samples minus 1
    _outliers: int = 0

    def __post_init__(self) -> None:
        self._response = (
            -math.expm1(-SAMPLE_S / self.tube_time_constant_s) if self.tube_time_constant_s > 0 else 1.0
        )
        self._rate_response_s = SAMPLE_S - self.tube_time_constant_s * self._response
        self._gains, self.noise_kpa = stationary_gains(self._response, self._rate_response_s)
        self.delay_s = self._simulate_delay_s()

    @property
    def present_noise_kpa(self) -> float:
        """Return the standard deviation [kPa] that noise now causes in the compensated pressure.

        At rest, the noise is 40 % of that of the filter. With a large lead, it is that of the filter.
        """
        squared = (self._pressure_kpa - self.smoothed_kpa) ** 2
        lead_share = squared / (squared + (SHRINKAGE_STDS * self.noise_kpa) ** 2)
        return self.noise_kpa * (REST_NOISE_SHARE + (1 - REST_NOISE_SHARE) * lead_share)

    def step(self, reading_kpa: float, dt_s: float) -> float:
        """Return the pressure in the balloon [kPa] from a reading `dt_s` after the last reading.

        A reading of NaN restarts the filter.
        """
        steps = max(round(dt_s / SAMPLE_S), 1)
        if steps > MAX_BRIDGED_SAMPLES or not math.isfinite(reading_kpa + self._sensor_kpa):
            return self._restart(reading_kpa)
        for _ in range(steps):
            self._sensor_kpa += self._response * (self._pressure_kpa - self._sensor_kpa)
            self._sensor_kpa += self._rate_response_s * self.rate_kpa_per_s
            self._pressure_kpa += SAMPLE_S * self.rate_kpa_per_s
        innovation_kpa = reading_kpa - self._sensor_kpa
        if not -OUTLIER_KPA <= innovation_kpa <= OUTLIER_KPA and self._outliers < MAX_OUTLIERS:
            self._outliers += 1
            return self._shrunk_kpa()
        self._outliers = 0
        self.smoothed_kpa += (reading_kpa - self.smoothed_kpa) * min(dt_s / SMOOTHING_TIME_CONSTANT_S, 1.0)
        pressure_gain, rate_gain, sensor_gain = self._gains[steps - 1]
        self._pressure_kpa += pressure_gain * innovation_kpa
        self.rate_kpa_per_s += rate_gain * innovation_kpa
        self._sensor_kpa += sensor_gain * innovation_kpa
        return self._shrunk_kpa()

    def _restart(self, reading_kpa: float) -> float:
        self.smoothed_kpa = self._pressure_kpa = self._sensor_kpa = reading_kpa
        self.rate_kpa_per_s, self._outliers = 0.0, 0
        return reading_kpa

    def _shrunk_kpa(self) -> float:
        """Return the filtered pressure, moved towards the smoothed reading.

        The lead is the filtered pressure minus the smoothed reading. The lead is multiplied by
        lead²/(lead² + (2 σ)²), with the noise σ of the filter. A pressure at rest therefore has little noise,
        and a large lead hardly changes.
        """
        lead_kpa = self._pressure_kpa - self.smoothed_kpa
        squared = lead_kpa * lead_kpa
        return self.smoothed_kpa + lead_kpa * squared / (squared + (SHRINKAGE_STDS * self.noise_kpa) ** 2)

    def _simulate_delay_s(self) -> float:
        """Return the delay of the peak [s] after filtering a simulated press without noise."""
        sensor_kpa, outputs_kpa = 0.0, []
        for n in range(round(REFERENCE_PRESS_S / SAMPLE_S)):
            pressure_kpa = math.sin(math.pi * n * SAMPLE_S / REFERENCE_PRESS_S) ** 2
            sensor_kpa += self._response * (pressure_kpa - sensor_kpa)
            outputs_kpa.append(self.step(sensor_kpa, SAMPLE_S))
        self._restart(math.nan)
        peak_s = max(range(len(outputs_kpa)), key=outputs_kpa.__getitem__) * SAMPLE_S
        return max(peak_s - REFERENCE_PRESS_S / 2, 0.0) + SAMPLE_S


@lru_cache(maxsize=16)
def stationary_gains(response: float, rate_response_s: float) -> tuple[list[list[float]], float]:
    """Return the stationary Kalman gains and the output noise of the filter.

    The gains are one triple (p, v, s) for each spacing of the readings, from 1 to `MAX_BRIDGED_SAMPLES`
    samples. The noise is the standard deviation of p [kPa] if no sample is lost.
    """
    import numpy as np

    dt = SAMPLE_S
    transition = np.array([[1, dt, 0], [0, 1, 0], [response, rate_response_s, 1 - response]])
    process_noise = PROCESS_NOISE_KPA2_PER_S3 * np.array(
        [[dt**3 / 3, dt**2 / 2, 0], [dt**2 / 2, dt, 0], [0, 0, 0]]
    )
    transition_powers, noise_sums = [transition], [process_noise]
    for _ in range(MAX_BRIDGED_SAMPLES - 1):
        noise_sums.append(transition @ noise_sums[-1] @ transition.T + process_noise)
        transition_powers.append(transition @ transition_powers[-1])
    transitions, process_noises = np.array(transition_powers), np.array(noise_sums)
    covariance = np.broadcast_to(np.diag([1.0, 100.0, 1.0]), transitions.shape)
    for _ in range(600):
        predicted = transitions @ covariance @ transitions.transpose(0, 2, 1) + process_noises
        gains = predicted[:, :, 2] / (predicted[:, 2, 2] + MEASUREMENT_NOISE_KPA**2)[:, None]
        covariance = predicted - gains[:, :, None] * predicted[:, None, 2, :]
    feedback = (np.eye(3) - np.outer(gains[0], [0.0, 0.0, 1.0])) @ transition
    output_noise = np.outer(gains[0], gains[0]) * MEASUREMENT_NOISE_KPA**2
    for _ in range(14):  # each repetition doubles the number of past samples, up to 2¹⁴
        output_noise, feedback = output_noise + feedback @ output_noise @ feedback.T, feedback @ feedback
    return gains.tolist(), math.sqrt(output_noise[0, 0])
