"""PeakEstimates of the pressure in the balloon from samples before and after one instant.

The present pressure can be estimated from past samples only, so its noise is larger and it overshoots after a
sudden change. For a peak there is time to wait for the samples after it.

The readings s lag behind the pressure p in the balloon with the time constant τ of the tube: p = s + τ s'.
An estimate averages s and s' with triangular weights around one moment. There are four estimates:

- wide, over ±128 ms: noise 1.3 Pa, for plateaus. A short peak becomes too low.
- middle, over ±64 ms: noise 2.7 Pa. Rises and falls are detected in this estimate.
- flat, (4 × middle − wide) ÷ 3: noise 4 Pa, for peaks of half a second. The errors of both parts due to the
  curvature cancel (Richardson extrapolation).
- narrow, (4 × the estimate over ±32 ms − middle) ÷ 3: noise 8 Pa, for peaks of 0.2 s.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cache
from itertools import accumulate
from typing import NamedTuple

from pneuforce.instrument.measurement.lag import MEASUREMENT_NOISE_KPA, SAMPLE_S

WIDE, MIDDLE, NARROW = 64, 32, 16  #: half-widths of the triangular weights, in samples
#: The estimates belong to the sample that is this number of samples before the latest sample.
DELAY = WIDE
#: Samples that the estimates use, and the number of samples at which older samples are discarded.
USED, MAX_SAMPLES = 2 * WIDE + 1, 400
#: An estimate counts if it exceeds the wide one by this number of standard deviations of its noise. The
#: largest of 1000 estimates of a constant pressure rarely exceeds their mean by more than 4 of them.
SIGNIFICANT_STDS = 4.5


class Moment(NamedTuple):
    """Time of a sample, its rise by the lag compensation, and the uncertainty of its force."""

    t_s: float
    rise_kpa: float
    force_std_n: float


class PeakEstimates(NamedTuple):
    """PeakEstimates of the rise at one moment [kPa]."""

    wide_kpa: float
    flat_kpa: float
    narrow_kpa: float
    middle_kpa: float


@dataclass(slots=True)
class RecentReadings:
    """Latest readings, as sums, so that each average takes the same time."""

    moments: list[Moment] = field(default_factory=list)
    sums: list[float] = field(default_factory=lambda: [0.0])  # sum of all readings before each sample
    sums_of_sums: list[float] = field(default_factory=lambda: [0.0])

    def add(self, reading_kpa: float, moment: Moment) -> None:
        """Add one sample. The pressure before the first sample is assumed to be that of the first sample."""
        moments, sums, sums_of_sums = self.moments, self.sums, self.sums_of_sums
        if not moments:
            moments.extend([moment] * (USED - 1))
            sums.extend(n * reading_kpa for n in range(1, USED))
            sums_of_sums[:] = accumulate(sums)
        moments.append(moment)
        total_kpa = sums[-1] + reading_kpa
        sums.append(total_kpa)
        sums_of_sums.append(sums_of_sums[-1] + total_kpa)
        if len(moments) > MAX_SAMPLES:
            del self.moments[:-USED]
            self.sums = [total - self.sums[-USED - 1] for total in self.sums[-USED - 1 :]]
            self.sums_of_sums = list(accumulate(self.sums))

    @property
    def complete(self) -> bool:
        """Return True if the estimates use samples only, and no assumed pressure before the first sample.

        The assumption is wrong if the samples begin in a contact: the pressure then rose or fell before.
        """
        oldest, next_ = self.moments[-USED : -USED + 2]
        return oldest.t_s != next_.t_s

    def estimates(self, tube_time_constant_s: float) -> PeakEstimates:
        """Return the estimates `DELAY` samples before the latest sample."""
        wide_kpa = self._pressure_kpa(WIDE, tube_time_constant_s)
        middle_kpa = self._pressure_kpa(MIDDLE, tube_time_constant_s)
        narrow_kpa = self._pressure_kpa(NARROW, tube_time_constant_s)
        flat_kpa, narrow_kpa = (4 * middle_kpa - wide_kpa) / 3, (4 * narrow_kpa - middle_kpa) / 3
        return PeakEstimates(wide_kpa, flat_kpa, narrow_kpa, middle_kpa)

    def _pressure_kpa(self, width: int, tube_time_constant_s: float) -> float:
        """Return s + τ s', averaged with triangular weights over ±`width` samples."""
        sums, sums_of_sums = self.sums, self.sums_of_sums
        at = len(sums) - 2 - DELAY
        first, last = at - width, at + width
        mean_kpa = (sums_of_sums[last] - 2 * sums_of_sums[at] + sums_of_sums[first]) / (width * width)
        difference_kpa = sums[last + 1] - sums[at + 1] - sums[at] + sums[first]
        return mean_kpa + tube_time_constant_s * difference_kpa / (width * (width + 1) * SAMPLE_S)


class SignificantDifferences(NamedTuple):
    """Differences to the wide estimate that noise does not explain [kPa]."""

    flat_kpa: float
    narrow_kpa: float


@cache
def significant_differences(tube_time_constant_s: float) -> SignificantDifferences:
    """Return the differences for the sensor noise, from the responses of the estimates to one reading."""
    readings, variances_kpa2 = RecentReadings(), [0.0] * len(PeakEstimates._fields)
    for n in range(2 * USED):
        readings.add(MEASUREMENT_NOISE_KPA if n == 1 else 0.0, Moment(0.0, 0.0, 0.0))
        estimates = readings.estimates(tube_time_constant_s)
        variances_kpa2 = [v + kpa * kpa for v, kpa in zip(variances_kpa2, estimates, strict=True)]
    stds = PeakEstimates(*(math.sqrt(variance) for variance in variances_kpa2))
    return SignificantDifferences(SIGNIFICANT_STDS * stds.flat_kpa, SIGNIFICANT_STDS * stds.narrow_kpa)
