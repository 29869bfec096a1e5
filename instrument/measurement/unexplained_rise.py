"""Unexplained rise: the slow rise of the locked pressure that is either drift or a slow press.

Warming gas, a leak of the inlet valve and insufflation raise the locked pressure. A slow press raises the
pressure too. The pressure alone does not show which of them is the cause. Therefore, this module adds up the
slow rises. The uncertainty of the force covers both causes.

- `before_kpa`: The baseline follows a slow rise without contact. Since the lock, the baseline has risen by
  this value, measured from its lowest value and in addition to the leak. If the cause was a press, the true
  ΔP_i is lower by this value, and the true force is higher than the displayed force.
- `during_kpa`: The pressure has risen slowly by this value during a contact. If the cause was drift, the true
  force is lower than the displayed force.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

#: Highest unexplained rise with a valid force. Warming explains at most this rise: 0.45 kPa by the insertion
#: into a body, and 0.4 kPa by 2 K in the circuit (docs/model.md).
MAX_UNEXPLAINED_KPA = 0.85
#: A faster rise during a contact is a press. At ΔP_i = 8 kPa and below 1 N, this is a press with 0.27 N/s. An
#: inlet that leaks 0.1 kPa/s, or an insufflation to 1.5 kPa in 10 s, is slower.
MAX_SLOW_KPA_PER_S = 0.11
#: At a lower ΔP_i, the same gas flow and the same press raise the pressure faster. In this span of ΔP_i, the
#: limit is inversely proportional to ΔP_i. Outside, the limit is constant.
SLOW_SPAN_KPA = 4.0, 9.0
#: ΔP_i at which the limit is `MAX_SLOW_KPA_PER_S`.
SLOW_REFERENCE_KPA = 8.0
#: Time over which the rate of a contact is measured. The noise of this rate is 3 Pa/s.
RATE_TIME_S = 1.0
#: A change of the pressure by more than this value above `MAX_SLOW_KPA_PER_S` is fast at once. The smoothed
#: reading has a noise of 2.4 Pa.
FAST_STEP_KPA = 0.02
#: Time after a fast change in which a slow change belongs to the fast change: three lags of the tube.
SETTLING_S = 0.2
#: A smaller change of the pressure is noise. The measurement continues until the change is larger.
MIN_CHANGE_KPA = 0.01
#: If ΔP_i rises by 1 kPa, the pressure at a constant force rises by only 0.6 to 0.9 kPa, because the same
#: force causes a smaller rise at a higher ΔP_i. A slow rise in a contact is multiplied by this factor.
FREE_TO_PRESSED_RATIO = 1.7
#: Time constant with which a slow fall during a contact is forgotten. A slow rise that regains such a fall is
#: a changing force, for example due to breathing. The fall itself does not show that the drift has ended.
REGAIN_TIME_CONSTANT_S = 40.0
#: Time constant with which the lowest baseline follows a lower baseline. After a contact the gas is cold, and
#: the pressure dips for 0.3 s. Such a dip is no new lowest value.
DIP_TIME_CONSTANT_S = 2.0
#: Time constant with which a leak that is no longer measured is forgotten, because a slow press hides a leak.
#: A longer time would add more of the creep of the latex, which fades after an inflation.
LEAK_MEMORY_S = 120.0
#: A leak below this rate is not added up, because it is not distinct from noise.
MIN_LEAK_KPA_PER_S = 0.0005


def max_slow_kpa_per_s(baseline_kpa: float) -> float:
    """Return the highest rate of a rise that drift can cause during a contact, at ΔP_i [kPa/s]."""
    low_kpa, high_kpa = SLOW_SPAN_KPA
    return MAX_SLOW_KPA_PER_S * SLOW_REFERENCE_KPA / min(max(baseline_kpa, low_kpa), high_kpa)


@dataclass(slots=True)
class UnexplainedRise:
    """Sum of the slow rises of the locked pressure."""

    _committed_kpa: float = 0.0  # slow rise during the present contact, without the present measurement
    _fallen_kpa: float = 0.0  # recent slow fall during the present contact that was not regained
    _above_kpa: float = 0.0  # baseline minus its lowest value; negative for a short time after a dip
    _leak_kpa_per_s: float = 0.0  # negative: rate at which the lowest value falls
    _anchor_kpa: float = math.nan  # pressure at the start of the present measurement of the rate
    _anchor_s: float = 0.0  # time since that start; negative until a fast change has settled
    during_kpa: float = 0.0  #: slow rise during the present contact; 0 without contact

    @property
    def before_kpa(self) -> float:
        """Return the unexplained rise of the baseline since the lock [kPa]."""
        return max(self._above_kpa, 0.0)

    @property
    def exceeded(self) -> bool:
        """Return True if no warming explains the rise, so that the baseline is unknown. NaN is unknown."""
        return not self.before_kpa + self.during_kpa <= MAX_UNEXPLAINED_KPA

    def move_baseline(self, change_kpa: float) -> None:
        """Add a change of the baseline [kPa] at one instant."""
        self._above_kpa += change_kpa

    def follow_baseline(self, change_kpa: float, drift_kpa_per_s: float, dt_s: float) -> None:
        """Add a change of the baseline without contact [kPa]. The drift is negative if there is a leak."""
        remembered_kpa_per_s = self._leak_kpa_per_s * (1 - min(dt_s / LEAK_MEMORY_S, 1.0))
        self._leak_kpa_per_s = min(drift_kpa_per_s, remembered_kpa_per_s)
        self._above_kpa += change_kpa - min(self._leak_kpa_per_s + MIN_LEAK_KPA_PER_S, 0.0) * dt_s
        if self._above_kpa < 0:
            self._above_kpa *= 1 - min(dt_s / DIP_TIME_CONSTANT_S, 1.0)

    def start_contact(self, rest_kpa: float, rest_s: float) -> None:
        """Start a contact. The pressure was at rest for the last time at `rest_kpa`, `rest_s` ago."""
        self._anchor_kpa, self._anchor_s = rest_kpa, rest_s
        self._committed_kpa = self._fallen_kpa = 0.0

    def follow_contact(self, smoothed_kpa: float, baseline_kpa: float, dt_s: float) -> None:
        """Add one sample of a contact: the smoothed reading, and the present ΔP_i."""
        if self._anchor_s < 0:
            self._anchor_kpa = smoothed_kpa
        self._anchor_s += dt_s
        change_kpa = smoothed_kpa - self._anchor_kpa
        slow_kpa = max_slow_kpa_per_s(baseline_kpa) * self._anchor_s
        # A force is never negative, so drift explains at most the present rise.
        most_kpa = max(smoothed_kpa - baseline_kpa, 0.0)
        self._committed_kpa = min(self._committed_kpa, most_kpa)
        self._fallen_kpa *= 1 - min(dt_s / REGAIN_TIME_CONSTANT_S, 1.0)
        fast = not abs(change_kpa) <= max(slow_kpa, 0.0) + FAST_STEP_KPA
        complete = self._anchor_s >= RATE_TIME_S
        if fast or (complete and not abs(change_kpa) <= slow_kpa):
            change_kpa = 0.0
        gained_kpa = FREE_TO_PRESSED_RATIO * max(change_kpa - self._fallen_kpa, 0.0)
        self.during_kpa = min(self._committed_kpa + gained_kpa, most_kpa)
        if fast or complete:
            self._anchor_s = -SETTLING_S if fast else 0.0
            if abs(smoothed_kpa - self._anchor_kpa) > MIN_CHANGE_KPA:
                self._committed_kpa, self._anchor_kpa = self.during_kpa, smoothed_kpa
                self._fallen_kpa = max(self._fallen_kpa - change_kpa, 0.0)

    def end_contact(self, change_kpa: float) -> None:
        """End a contact. The new baseline differs from ΔP_i by `change_kpa`."""
        self.during_kpa = 0.0
        self.move_baseline(change_kpa)
