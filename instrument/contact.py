"""Contact tracking: when a contact begins and ends, and the pressure ΔP_i before it.

ΔP_i is the lowest pressure before the rise, measured anew for each contact (paper, Section IV-B). While
the balloon is free a floor follows the pressure, quickly down and slowly up: the baseline.

A contact ends when the pressure is back at its floor. Where the next contact comes before that, it is
told from a mere easing of the hand by how far the pressure fell: once the rise has dropped below
`RELEASED` of its peak, the next upturn is a new contact. It keeps its ΔP_i: the gas is locked, and the
pressure in the balloon does not lag, so what is left of the rise in the trough is force. (The paper took the
trough of a pressure that lags.)
"""

from __future__ import annotations

import math
from dataclasses import dataclass

#: Rise of the pressure in the balloon (its lag undone, noise 0.02 kPa) that is a contact ...
ONSET_KPA = 0.06
#: ... where the calm reading (noise 0.0024 kPa) has risen too.
CONFIRMED_KPA = 0.02
END_KPA = 0.015
RELEASED = 0.3
#: Upturn from the trough between two contacts: six times the noise, and a share of the last peak's rise.
AGAIN_KPA = 0.12
AGAIN = 0.1
#: Zero tracking: a free pressure that rises more slowly is drift, faster is contact.
TRACKING_KPA_PER_S = 0.03
#: Downwards the floor takes its time too: gas that a contact has heated leaves a dip of some 0.3 s.
SINKING_S = 0.3
#: A leak that was seen before a contact goes on under it, at most this fast [kPa/s]; seen over `LEAK_S`.
LEAK_KPA_PER_S, LEAK_S = 0.05, 10.0
#: Gas that was warming before a contact warms on for about this time.
WARMING_S = 20.0
#: Within this of the floor the pressure has not begun to rise.
AT_REST_KPA = 0.012
DRIFT_S = 5.0


def presses_again(now_kpa: float, initial_kpa: float, peak_kpa: float, trough_kpa: float) -> bool:
    """Whether this upturn after a trough is a new contact, and no easing of the hand in the same one."""
    rise_kpa = peak_kpa - initial_kpa
    released = trough_kpa - initial_kpa < RELEASED * rise_kpa
    return released and now_kpa - max(trough_kpa, initial_kpa) > max(AGAIN_KPA, AGAIN * rise_kpa)


@dataclass(slots=True)
class ContactTracker:
    """Follows the pressure of the locked balloon."""

    in_contact: bool = False
    initial_kpa: float = math.nan  #: ΔP_i of the contact in progress, else the baseline
    count: int = 0  #: contacts begun
    finished: int = 0  #: contacts ended
    drift_kpa_per_s: float = math.nan  #: of the baseline; in contact, what it was before
    baseline_age_s: float = math.inf  #: where there was none yet
    #: A contact ended that its drift may have hidden: nothing is known until the next lock.
    lost: bool = False
    _leak_kpa_per_s: float = 0.0
    _rest_kpa: float = math.nan  # the floor when the pressure was last at rest on it
    _peak_kpa: float = math.nan
    _trough_kpa: float = math.nan
    _slow_kpa: float = math.nan

    def step(self, calm_kpa: float, now_kpa: float, locked: bool, dt_s: float) -> None:
        """One sample later: the calm reading, and the pressure now. Without a lock all is forgotten."""
        if not locked or not math.isfinite(calm_kpa + now_kpa):
            self._unlocked(dt_s)
            return
        if not math.isfinite(self.initial_kpa):
            self.initial_kpa = self._rest_kpa = self._slow_kpa = calm_kpa
        if self.in_contact:
            self._pressed(calm_kpa, now_kpa, dt_s)
        else:
            self._free(calm_kpa, now_kpa, dt_s)

    def blind(self, dt_s: float) -> None:
        """A sample that tells nothing, while the balloon is still locked."""
        self.baseline_age_s += dt_s

    @property
    def drifted_kpa(self) -> float:
        """How far the baseline may have moved since it was last seen [kPa]."""
        return abs(self.drift_kpa_per_s) * self.baseline_age_s

    def _unlocked(self, dt_s: float) -> None:
        if self.in_contact:
            self._end()
        self.initial_kpa = self.drift_kpa_per_s = math.nan
        self.lost, self._leak_kpa_per_s = False, 0.0
        self.baseline_age_s += dt_s

    def _free(self, calm_kpa: float, now_kpa: float, dt_s: float) -> None:
        above_kpa = calm_kpa - self.initial_kpa
        if not self.lost and above_kpa > CONFIRMED_KPA and now_kpa - self.initial_kpa > ONSET_KPA:
            self._begin(self._rest_kpa, now_kpa)
            return
        down_kpa = above_kpa * min(dt_s / SINKING_S, 1.0)
        self.initial_kpa += min(down_kpa if above_kpa < 0 else above_kpa, TRACKING_KPA_PER_S * dt_s)
        if above_kpa < AT_REST_KPA:
            self._rest_kpa = self.initial_kpa
        self._slow_kpa += (calm_kpa - self._slow_kpa) * min(dt_s / DRIFT_S, 1.0)
        self.drift_kpa_per_s = (calm_kpa - self._slow_kpa) / DRIFT_S
        leak_kpa_per_s = max(min(self.drift_kpa_per_s, 0.0), -LEAK_KPA_PER_S)
        self._leak_kpa_per_s += (leak_kpa_per_s - self._leak_kpa_per_s) * min(dt_s / LEAK_S, 1.0)
        self.baseline_age_s = 0.0

    def _begin(self, initial_kpa: float, now_kpa: float) -> None:
        self.in_contact = True
        self.count += 1
        self.initial_kpa = initial_kpa
        self._peak_kpa = self._trough_kpa = now_kpa

    def _pressed(self, calm_kpa: float, now_kpa: float, dt_s: float) -> None:
        self.baseline_age_s += dt_s
        self.initial_kpa += self._leak_kpa_per_s * dt_s
        rise_kpa = self._peak_kpa - self.initial_kpa
        above_kpa, most_kpa = calm_kpa - self.initial_kpa - END_KPA, RELEASED * rise_kpa
        if above_kpa < most_kpa and above_kpa < min(self._warmed_kpa, most_kpa):
            self._end()
            self.lost = self.drifted_kpa > most_kpa
            self.initial_kpa = self._rest_kpa = calm_kpa
            self._slow_kpa = calm_kpa - self.drift_kpa_per_s * DRIFT_S
            return
        if now_kpa > self._peak_kpa:
            self._peak_kpa = self._trough_kpa = now_kpa
        self._trough_kpa = min(self._trough_kpa, now_kpa)
        if presses_again(now_kpa, self.initial_kpa, self._peak_kpa, self._trough_kpa):
            self._end()
            self._begin(self.initial_kpa, now_kpa)

    @property
    def _warmed_kpa(self) -> float:
        """Rise of the baseline under a contact [kPa], had it gone on as before and then faded."""
        drift_kpa_per_s = min(max(self.drift_kpa_per_s, 0.0), TRACKING_KPA_PER_S)
        return drift_kpa_per_s * WARMING_S * -math.expm1(-self.baseline_age_s / WARMING_S)

    def _end(self) -> None:
        self.in_contact = False
        self.finished += 1
