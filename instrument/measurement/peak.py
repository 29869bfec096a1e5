"""Peaks of the contact force: each local maximum, estimated from samples before and after the maximum.

The largest sample of a noisy force is too large. The height of a peak is therefore the largest wide estimate
of the pressure (`peak_estimates.py`), or the largest estimate over a shorter time if noise does not explain
the difference. The samples of the same contact are points of the force curve. The force of the peak is the
force of this curve at the height of the peak.
"""

from __future__ import annotations

import math
from bisect import bisect
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

from pneuforce.instrument.measurement.peak_estimates import (
    DELAY,
    Moment,
    PeakEstimates,
    RecentReadings,
    SignificantDifferences,
    significant_differences,
)
from pneuforce.protocol.limits import HOST_SILENCE_S

#: A peak is complete when the pressure has fallen by more than 2 u. u is only the noise of ΔP_f while the
#: pressure changes (26 Pa, `LagCompensator.noise_kpa`), because the other parts of the uncertainty shift a
#: peak and the trough after it alike.
MIN_FALL_KPA = 2 * 0.026
#: Rise after a peak that starts another peak if the samples are then interrupted. It is larger, because the
#: lag compensation suppresses small differences, so that its pressure remains too high for some time.
MIN_CUT_RISE_KPA = 2 * MIN_FALL_KPA
#: A longer gap between two samples interrupts the averages.
MAX_GAP_S = 0.02
#: Spacing of the points of the force curve, as a fraction of the rise, and the smallest rise of a point.
POINT_RATIO = 0.02
MIN_POINT_KPA = 0.01


class MeasuredSample(Protocol):
    """Fields that measurements and recorded samples have in common, see `measurement.py`."""

    @property
    def t_s(self) -> float:
        """Return the time of the sample."""

    @property
    def unfiltered_kpa(self) -> float:
        """Return the gauge pressure as sampled."""

    @property
    def baseline_kpa(self) -> float:
        """Return ΔP_i, NaN if the balloon is not locked."""

    @property
    def rise_kpa(self) -> float:
        """Return ΔP_f − ΔP_i with lag compensation."""

    @property
    def force_n(self) -> float:
        """Return the force at this rise."""

    @property
    def force_std_n(self) -> float:
        """Return the standard uncertainty of the force."""

    @property
    def in_contact(self) -> bool:
        """Return True during a contact."""


class Peak(NamedTuple):
    """One peak. Force and uncertainty are NaN if one of them is unknown."""

    t_s: float
    rise_kpa: float  #: pressure rise ΔP_f − ΔP_i
    force_n: float
    force_std_n: float


@dataclass(slots=True)
class _Maximum:
    """Largest estimates since the pressure began to rise."""

    wide_kpa: float = -math.inf
    flat_kpa: float = -math.inf
    narrow_kpa: float = -math.inf
    middle_kpa: float = -math.inf
    t_s: float = math.nan
    force_std_n: float = math.nan

    def add(self, estimates: PeakEstimates, significant: SignificantDifferences, moment: Moment) -> None:
        """Add the estimates at one moment.

        A wide estimate that is significantly larger than the narrow one belongs to another maximum nearby.
        """
        wide_kpa, flat_kpa, narrow_kpa, middle_kpa = estimates
        if self.wide_kpa < wide_kpa <= narrow_kpa + significant.narrow_kpa:
            self.wide_kpa = wide_kpa
        if flat_kpa > self.flat_kpa:
            self.flat_kpa = flat_kpa
        if middle_kpa > self.middle_kpa:
            self.middle_kpa = middle_kpa
        if narrow_kpa > self.narrow_kpa:
            self.narrow_kpa, self.t_s, self.force_std_n = narrow_kpa, moment.t_s, moment.force_std_n

    def best_kpa(self, significant: SignificantDifferences) -> float:
        """Return the estimate for the shortest time that is significantly larger than the wide estimate."""
        if self.narrow_kpa > self.wide_kpa + significant.narrow_kpa:
            return self.narrow_kpa
        return self.flat_kpa if self.flat_kpa > self.wide_kpa + significant.flat_kpa else self.wide_kpa


@dataclass(slots=True)
class PeakTracker:
    """Detector of the peaks in a stream of measurements, live or recorded.

    A peak is complete when the pressure has fallen by more than `MIN_FALL_KPA`, or when the contact ends. The
    next peak of the same contact begins when the pressure has risen by as much.
    """

    tube_time_constant_s: float
    count: int = 0  #: number of completed peaks
    _in_contact: bool = False
    _rising: bool = False  # False from a completed peak until the pressure rises again
    _highest: _Maximum = field(default_factory=_Maximum)
    _lowest_kpa: float = math.inf  # middle estimate since the last peak
    _readings: RecentReadings = field(default_factory=RecentReadings)
    _odd: bool = False  # the estimates are computed at every second sample
    _last_s: float = math.nan
    #: Rise and force of samples of this contact, by the logarithm of the rise: the force curve.
    _curve: dict[int, tuple[float, float]] = field(default_factory=dict)

    @property
    def highest(self) -> Peak | None:
        """Return the highest point so far of the peak in progress, or None."""
        return self._peak_at_highest() if self._rising and math.isfinite(self._highest.t_s) else None

    def step(self, m: MeasuredSample) -> Sequence[Peak]:
        """Process one sample. Return the peaks that are complete now, the oldest first; usually none.

        A sample without a reading is skipped. If the balloon is no longer locked, the contact ends.
        """
        if not math.isfinite(m.unfiltered_kpa):
            return ()
        gap_s, self._last_s = m.t_s - self._last_s, m.t_s
        locked = math.isfinite(m.baseline_kpa)
        peaks = [] if locked and 0 <= gap_s <= MAX_GAP_S else self._interrupt(locked, gap_s)
        if m.in_contact:
            if not self._in_contact:
                self._begin()
            if MIN_POINT_KPA < m.rise_kpa < math.inf and math.isfinite(m.force_n):
                self._curve[int(math.log(m.rise_kpa) / POINT_RATIO)] = m.rise_kpa, m.force_n
        elif self._in_contact:
            peaks += self._end()
        if locked:
            peaks += self._add(m)
        return peaks

    def _begin(self) -> None:
        self._in_contact = self._rising = self._odd = True
        self._highest = _Maximum()
        self._curve.clear()

    def _end(self) -> list[Peak]:
        """End the contact, and with it the peak in progress."""
        peaks = [self._complete()] if self.highest else []
        self._in_contact = self._rising = False
        return peaks

    def _interrupt(self, locked: bool, gap_s: float) -> list[Peak]:
        """Discard all readings. The contact ends if the balloon is not locked, or after a long gap.

        The latest samples have no estimates. Their compensated pressure is used instead, because a trip often
        interrupts a contact while its force rises.
        """
        latest = max(self._readings.moments[-DELAY:], key=lambda moment: moment.rise_kpa, default=None)
        if self._in_contact and latest:
            if not self._rising and latest.rise_kpa - self._lowest_kpa > MIN_CUT_RISE_KPA:
                self._rising, self._highest = True, _Maximum()
            best_kpa = self._highest.best_kpa(significant_differences(self.tube_time_constant_s))
            if self._rising and latest.rise_kpa - best_kpa > MIN_FALL_KPA:
                self._add_to_highest(PeakEstimates(*4 * (latest.rise_kpa,)), latest)
        self._readings = RecentReadings()
        continues = locked and 0 <= gap_s <= HOST_SILENCE_S
        return [] if continues else self._end()

    def _add(self, m: MeasuredSample) -> Sequence[Peak]:
        """Add one sample. During a contact, process the estimates at every second sample.

        In the first 0.26 s after a gap, there are no estimates.
        """
        readings = self._readings
        readings.add(m.unfiltered_kpa - m.baseline_kpa, Moment(m.t_s, m.rise_kpa, m.force_std_n))
        self._odd = not self._odd
        if self._odd or not self._in_contact or not readings.complete:
            return ()
        return self._follow(readings.estimates(self.tube_time_constant_s), readings.moments[-1 - DELAY])

    def _follow(self, estimates: PeakEstimates, moment: Moment) -> Sequence[Peak]:
        """Process the estimates at one moment. Return the peak if it is complete now."""
        now_kpa = max(estimates.middle_kpa, 0.0)
        if self._rising:
            self._add_to_highest(estimates, moment)
            return [self._complete()] if self._highest.middle_kpa - now_kpa > MIN_FALL_KPA else ()
        self._lowest_kpa = min(self._lowest_kpa, now_kpa)
        if now_kpa - self._lowest_kpa > MIN_FALL_KPA:
            self._rising, self._highest = True, _Maximum()
            self._add_to_highest(estimates, moment)
        return ()

    def _add_to_highest(self, estimates: PeakEstimates, moment: Moment) -> None:
        self._highest.add(estimates, significant_differences(self.tube_time_constant_s), moment)

    def _complete(self) -> Peak:
        peak = self._peak_at_highest()
        self._rising, self._lowest_kpa = False, math.inf
        self.count += 1
        return peak

    def _peak_at_highest(self) -> Peak:
        highest = self._highest
        rise_kpa = highest.best_kpa(significant_differences(self.tube_time_constant_s))
        force_n = force_at(rise_kpa, sorted(self._curve.values()))
        if not math.isfinite(force_n + highest.force_std_n):
            return Peak(highest.t_s, rise_kpa, math.nan, math.nan)
        return Peak(highest.t_s, rise_kpa, force_n, highest.force_std_n)


def force_at(rise_kpa: float, points: Sequence[tuple[float, float]]) -> float:
    """Return the force [N] at a rise, by linear interpolation between points (rise [kPa], force [N]).

    The points are in order of their rise. Outside of them, the force is proportional to the rise. Without
    points, the force is NaN.
    """
    if not points:
        return math.nan
    right = bisect(points, (rise_kpa, math.inf))
    if right in (0, len(points)):
        end_kpa, end_n = points[max(right - 1, 0)]
        return end_n * rise_kpa / end_kpa
    (left_kpa, left_n), (right_kpa, right_n) = points[right - 1], points[right]
    return left_n + (right_n - left_n) * (rise_kpa - left_kpa) / (right_kpa - left_kpa)
