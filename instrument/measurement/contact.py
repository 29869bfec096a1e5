"""Contact tracking: start and end of each contact, and the pressure ΔP_i before it.

ΔP_i is the lowest pressure before the rise, measured for each contact (paper, Section IV-B). While the
balloon is free, the baseline follows the pressure: fast downwards, slowly upwards.

A contact ends when the pressure is back at the baseline. The next contact can also start earlier, when the
pressure turns upwards after a trough. This is a new contact if the rise in the trough was below
`RELEASE_RATIO` of the peak. Otherwise the same contact continues. The new contact keeps ΔP_i, because the
remaining rise in the trough is force: the gas is locked, and the compensated pressure has no lag. (The paper
uses the trough as the new ΔP_i, but its pressure has a lag.)
"""

from __future__ import annotations

import math
from dataclasses import dataclass

#: A contact starts if the lag-compensated pressure (noise 0.02 kPa) has risen by this value, and the smoothed
#: reading by `CONFIRMED_KPA`.
ONSET_KPA = 0.06
#: Rise of the smoothed reading (noise 0.0024 kPa) that is necessary for the start of a contact.
CONFIRMED_KPA = 0.02
#: A contact ends when the smoothed reading is this close to the baseline.
END_KPA = 0.015
#: The balloon counts as released if the rise falls below this fraction of its peak.
RELEASE_RATIO = 0.3
#: Smallest upturn after a trough that starts a new contact: the larger of six times the noise and a fraction
#: of the peak.
MIN_UPTURN_KPA = 0.12
MIN_UPTURN_RATIO = 0.1
#: Highest rate of drift without contact. A faster rise of the pressure is a contact.
MAX_TRACKING_KPA_PER_S = 0.03
#: Time constant of a falling baseline. A contact heats the gas, and the pressure then dips for 0.3 s. The
#: baseline follows such a short dip only in part.
FALL_TIME_CONSTANT_S = 0.3
#: Highest leak rate by which ΔP_i is lowered during a contact. The leak is measured before the contact.
MAX_LEAK_KPA_PER_S = 0.05
LEAK_TIME_CONSTANT_S = 10.0  #: time constant of the average of the leak rate
#: If the gas warms before a contact, it continues to warm for about this time during the contact.
WARMING_TIME_CONSTANT_S = 20.0
#: A pressure within this distance of the baseline is at rest: it has not begun to rise.
AT_REST_KPA = 0.012
DRIFT_TIME_CONSTANT_S = 5.0


def is_new_contact(now_kpa: float, baseline_kpa: float, peak_kpa: float, trough_kpa: float) -> bool:
    """Return True if the upturn after a trough is a new contact. Otherwise the same contact continues."""
    rise_kpa = peak_kpa - baseline_kpa
    released = trough_kpa - baseline_kpa < RELEASE_RATIO * rise_kpa
    upturn_kpa = now_kpa - max(trough_kpa, baseline_kpa)
    return released and upturn_kpa > max(MIN_UPTURN_KPA, MIN_UPTURN_RATIO * rise_kpa)


@dataclass(slots=True)
class ContactTracker:
    """Detector of contacts in the pressure of the locked balloon."""

    in_contact: bool = False
    baseline_kpa: float = math.nan  #: ΔP_i of the contact in progress; without contact, the baseline
    contact_count: int = 0  #: number of contacts that have started
    finished_count: int = 0  #: number of contacts that have ended
    drift_kpa_per_s: float = math.nan  #: drift of the baseline; during a contact, the drift before it
    baseline_age_s: float = math.inf  #: time since the baseline was last measured; infinite if never
    #: True if drift may hide a contact that continues: the last contact seemed to end, but the possible drift
    #: was above `RELEASE_RATIO` of the rise. The baseline is unknown until the balloon is locked again.
    baseline_lost: bool = False
    _leak_kpa_per_s: float = 0.0
    _rest_kpa: float = math.nan  # baseline at the last time when the pressure was at rest
    _peak_kpa: float = math.nan
    _trough_kpa: float = math.nan
    _slow_kpa: float = math.nan  # slow average of the smoothed reading, for the drift

    def step(self, smoothed_kpa: float, now_kpa: float, locked: bool, dt_s: float) -> None:
        """Process one sample: the smoothed reading, and the lag-compensated pressure `now_kpa`.

        If the balloon is not locked or a pressure is not finite, the contact ends and the baseline is reset.
        """
        if not locked or not math.isfinite(smoothed_kpa + now_kpa):
            self._reset(dt_s)
            return
        if not math.isfinite(self.baseline_kpa):
            self.baseline_kpa = self._rest_kpa = self._slow_kpa = smoothed_kpa
        if self.in_contact:
            self._step_contact(smoothed_kpa, now_kpa, dt_s)
        else:
            self._step_free(smoothed_kpa, now_kpa, dt_s)

    def skip(self, dt_s: float) -> None:
        """Skip an invalid sample while the balloon remains locked."""
        self.baseline_age_s += dt_s

    def pause(self, smoothed_kpa: float, dt_s: float) -> None:
        """Skip a sample of a proof test. The pulses of the test change the pressure, which is no drift."""
        self.skip(dt_s)
        if math.isfinite(self.drift_kpa_per_s):
            self._slow_kpa = smoothed_kpa - self.drift_kpa_per_s * DRIFT_TIME_CONSTANT_S

    @property
    def drifted_kpa(self) -> float:
        """Return the possible drift of the baseline since its last measurement [kPa]."""
        return abs(self.drift_kpa_per_s) * self.baseline_age_s

    def _reset(self, dt_s: float) -> None:
        if self.in_contact:
            self._end_contact()
        self.baseline_kpa = self.drift_kpa_per_s = math.nan
        self.baseline_lost, self._leak_kpa_per_s = False, 0.0
        self.baseline_age_s += dt_s

    def _step_free(self, smoothed_kpa: float, now_kpa: float, dt_s: float) -> None:
        above_kpa = smoothed_kpa - self.baseline_kpa
        if not self.baseline_lost and above_kpa > CONFIRMED_KPA and now_kpa - self.baseline_kpa > ONSET_KPA:
            self._start_contact(self._rest_kpa, now_kpa)
            return
        fall_kpa = above_kpa * min(dt_s / FALL_TIME_CONSTANT_S, 1.0)
        self.baseline_kpa += min(fall_kpa if above_kpa < 0 else above_kpa, MAX_TRACKING_KPA_PER_S * dt_s)
        if above_kpa < AT_REST_KPA:
            self._rest_kpa = self.baseline_kpa
        self._slow_kpa += (smoothed_kpa - self._slow_kpa) * min(dt_s / DRIFT_TIME_CONSTANT_S, 1.0)
        self.drift_kpa_per_s = (smoothed_kpa - self._slow_kpa) / DRIFT_TIME_CONSTANT_S
        leak_kpa_per_s = max(min(self.drift_kpa_per_s, 0.0), -MAX_LEAK_KPA_PER_S)
        self._leak_kpa_per_s += (leak_kpa_per_s - self._leak_kpa_per_s) * min(
            dt_s / LEAK_TIME_CONSTANT_S, 1.0
        )
        self.baseline_age_s = 0.0

    def _start_contact(self, baseline_kpa: float, now_kpa: float) -> None:
        self.in_contact = True
        self.contact_count += 1
        self.baseline_kpa = baseline_kpa
        self._peak_kpa = self._trough_kpa = now_kpa

    def _step_contact(self, smoothed_kpa: float, now_kpa: float, dt_s: float) -> None:
        self.baseline_age_s += dt_s
        self.baseline_kpa += self._leak_kpa_per_s * dt_s
        released_kpa = RELEASE_RATIO * (self._peak_kpa - self.baseline_kpa)
        above_kpa = smoothed_kpa - self.baseline_kpa - END_KPA
        if above_kpa < released_kpa and above_kpa < self._warming_kpa:
            self._end_contact()
            self.baseline_lost = self.drifted_kpa > released_kpa
            self.baseline_kpa = self._rest_kpa = smoothed_kpa
            self._slow_kpa = smoothed_kpa - self.drift_kpa_per_s * DRIFT_TIME_CONSTANT_S
            return
        if now_kpa > self._peak_kpa:
            self._peak_kpa = self._trough_kpa = now_kpa
        self._trough_kpa = min(self._trough_kpa, now_kpa)
        if is_new_contact(now_kpa, self.baseline_kpa, self._peak_kpa, self._trough_kpa):
            self._end_contact()
            self._start_contact(self.baseline_kpa, now_kpa)

    @property
    def _warming_kpa(self) -> float:
        """Return the rise of the baseline [kPa] since the contact began.

        The rise is an estimate: the drift before the contact is assumed to continue and to fade.
        """
        drift_kpa_per_s = min(max(self.drift_kpa_per_s, 0.0), MAX_TRACKING_KPA_PER_S)
        faded_age_s = -math.expm1(-self.baseline_age_s / WARMING_TIME_CONSTANT_S)
        return drift_kpa_per_s * WARMING_TIME_CONSTANT_S * faded_age_s

    def _end_contact(self) -> None:
        self.in_contact = False
        self.finished_count += 1
