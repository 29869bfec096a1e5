"""Contact tracking: start and end of each contact, and the pressure ΔP_i before it.

ΔP_i is the lowest pressure before the rise, measured for each contact (paper, Section IV-B). While the
balloon is free, the baseline follows the pressure: fast downwards, slowly upwards.

A contact ends when the pressure is back at the baseline. The next contact can also start earlier, when the
pressure turns upwards after a trough (`contact_extremes.py`). The new contact keeps ΔP_i, because the
remaining rise in the trough is force: the gas is locked, and the compensated pressure has no lag. (The paper
uses the trough as the new ΔP_i, but its pressure has a lag.)

After a release, the gas is cold for about a second (`gas_heat.py`), and its pressure recovers to ΔP_i from
below. The baseline does not follow a dip that the cooling explains: otherwise, the recovery would look like
a contact.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from pneuforce.instrument.measurement.contact_extremes import RELEASE_RATIO, ContactExtremes
from pneuforce.instrument.measurement.gas_heat import GasHeat
from pneuforce.instrument.measurement.unexplained_rise import UnexplainedRise

#: A contact starts if the lag-compensated pressure (noise 0.02 kPa) has risen by this value, and the smoothed
#: reading by `CONFIRMED_KPA`.
ONSET_KPA = 0.06
#: Rise of the smoothed reading (noise 0.0024 kPa) that is necessary for the start of a contact.
CONFIRMED_KPA = 0.02
#: A contact ends when the smoothed reading is this close to the baseline.
END_KPA = 0.015
#: Highest rate of drift without contact. A faster rise of the pressure is a contact.
MAX_TRACKING_KPA_PER_S = 0.03
#: Time constant of a falling baseline.
FALL_TIME_CONSTANT_S = 0.3
#: Highest leak rate by which ΔP_i is lowered during a contact. The leak is measured before the contact.
MAX_LEAK_KPA_PER_S = 0.05
#: Fastest fall of the baseline that is measured as a drift. A faster fall is the release of an object that
#: pressed on the balloon when it was locked.
MAX_FALL_KPA_PER_S = 0.2
LEAK_TIME_CONSTANT_S = 10.0  #: time constant of the average of the leak rate
#: If the gas warms before a contact, it continues to warm for about this time during the contact.
WARMING_TIME_CONSTANT_S = 20.0
#: A pressure within this distance of the baseline is at rest: it has not begun to rise.
AT_REST_KPA = 0.012
#: The drift is the difference between two averages of the smoothed reading, divided by the difference of
#: their time constants.
DRIFT_TIME_CONSTANTS_S = 1.0, 4.0
#: The drift during a contact is that of at least this time before the contact was detected. It therefore does
#: not contain the beginning of the contact.
DRIFT_DELAY_S = 1.0
#: Time after a lock or a contact until the gas has settled. The drift is not measured in this time, and not
#: until the gas is warm again.
SETTLING_S = 0.5
#: Largest change of the pressure by the two pulses of a proof test, apart from drift.
MAX_TEST_CHANGE_KPA = 0.03


@dataclass(slots=True)
class ContactTracker:
    """Detector of contacts in the pressure of the locked balloon."""

    in_contact: bool = False
    baseline_kpa: float = math.nan  #: ΔP_i of the contact in progress; without contact, the baseline
    contact_count: int = 0  #: number of contacts that have started
    finished_count: int = 0  #: number of contacts that have ended
    drift_kpa_per_s: float = math.nan  #: drift of the baseline; during a contact, the drift before it
    baseline_age_s: float = math.inf  #: time since the baseline was last measured; infinite if never
    #: True if the pressure around the inflated balloon has changed: the baseline is unknown until a vent.
    baseline_lost: bool = False
    #: Slow rises that are drift or a press. A new lock keeps them, because it does not end a hidden contact.
    unexplained: UnexplainedRise = field(default_factory=UnexplainedRise)
    gas_heat: GasHeat = field(default_factory=GasHeat)
    _mean_drift_kpa_per_s: float = 0.0  # average of the drift; a negative value is a leak
    _rest_kpa: float = math.nan  # baseline at the last time when the pressure was at rest
    _rest_s: float = 0.0  # time since then
    _extremes: ContactExtremes = field(default_factory=lambda: ContactExtremes.start(math.nan, math.nan))
    _averages_kpa: tuple[float, float] = (math.nan, math.nan)  # averages for the drift
    #: The drift and its average at two past instants. The first instant is the earlier one.
    _past_drifts: tuple[tuple[float, float], tuple[float, float]] = ((0.0, 0.0), (0.0, 0.0))
    _past_drift_s: float = 0.0  # time since the second instant; negative until the gas has settled
    _tested: bool = False  # True if a proof test has just ended

    def step(self, smoothed_kpa: float, now_kpa: float, locked: bool, dt_s: float) -> None:
        """Process one sample: the smoothed reading, and the lag-compensated pressure `now_kpa`.

        If the balloon is not locked or a pressure is not finite, the contact ends and the baseline is reset.
        """
        self.gas_heat.step(smoothed_kpa, dt_s)
        if not locked or not math.isfinite(smoothed_kpa + now_kpa):
            self._reset(smoothed_kpa, dt_s)
            return
        if not math.isfinite(self.baseline_kpa):
            self.baseline_kpa = self._rest_kpa = smoothed_kpa
            self._restart_drift(smoothed_kpa, 0.0, 0.0)
        if self.in_contact:
            self._step_contact(smoothed_kpa, now_kpa, dt_s)
        else:
            self._step_free(smoothed_kpa, now_kpa, dt_s)

    def skip(self, dt_s: float) -> None:
        """Skip an invalid sample while the balloon remains locked."""
        self.baseline_age_s += dt_s

    def pause(self, dt_s: float) -> None:
        """Skip a sample of a proof test. The pulses of the test change the pressure, which is no drift."""
        self.skip(dt_s)
        self._tested = True

    def empty(self) -> None:
        """Delete the unexplained rise, because the balloon is vented: no hidden contact remains in ΔP_i."""
        self.baseline_lost, self.unexplained = False, UnexplainedRise()

    @property
    def baseline_unknown(self) -> bool:
        """Return True if no force can be computed: a lost baseline, or a large unexplained rise."""
        return self.baseline_lost or self.unexplained.exceeded

    @property
    def hidden_kpa(self) -> float:
        """Return the largest rise [kPa] that a force can have in addition to the measured rise.

        A slow press can have raised the baseline, and cold gas can have lowered the pressure.
        """
        return self.unexplained.before_kpa + self.gas_heat.dip_kpa

    @property
    def drifted_kpa(self) -> float:
        """Return the possible drift of the baseline since its last measurement [kPa]."""
        return abs(self.drift_kpa_per_s) * self.baseline_age_s

    @property
    def leak_kpa_per_s(self) -> float:
        """Return the average rate at which the pressure falls [kPa/s]. The rate is negative or 0."""
        return max(min(self._mean_drift_kpa_per_s, 0.0), -MAX_LEAK_KPA_PER_S)

    def _reset(self, smoothed_kpa: float, dt_s: float) -> None:
        if self.in_contact:
            rise_kpa = smoothed_kpa - self.baseline_kpa
            self._end_contact(max(rise_kpa, 0.0) if math.isfinite(rise_kpa) else 0.0)
        self.baseline_kpa = self.drift_kpa_per_s = math.nan
        self.baseline_age_s += dt_s

    def _step_free(self, smoothed_kpa: float, now_kpa: float, dt_s: float) -> None:
        if self._tested:
            self._end_test(smoothed_kpa)
        above_kpa = smoothed_kpa - self.baseline_kpa
        if not self.baseline_lost and above_kpa > CONFIRMED_KPA and now_kpa - self.baseline_kpa > ONSET_KPA:
            self._start_first_contact(now_kpa, smoothed_kpa)
            return
        fall_kpa = min(above_kpa + self.gas_heat.dip_kpa, 0.0) * min(dt_s / FALL_TIME_CONSTANT_S, 1.0)
        change_kpa = fall_kpa if above_kpa < 0 else min(above_kpa, MAX_TRACKING_KPA_PER_S * dt_s)
        self.baseline_kpa += change_kpa
        self._rest_s += dt_s
        if above_kpa < AT_REST_KPA:
            self._rest_kpa, self._rest_s = self.baseline_kpa, 0.0
        self.unexplained.follow_baseline(change_kpa, self._mean_drift_kpa_per_s, dt_s)
        if fall_kpa < -MAX_FALL_KPA_PER_S * dt_s:
            self._restart_drift(smoothed_kpa, *self._past_drifts[0])
        self._measure_drift(smoothed_kpa, dt_s)
        self.baseline_age_s = 0.0

    def _end_test(self, smoothed_kpa: float) -> None:
        """Exclude the change of the pressure by a proof test from the drift and from the unexplained rise."""
        self._tested = False
        change_kpa = smoothed_kpa - self.baseline_kpa
        if abs(change_kpa) <= MAX_TEST_CHANGE_KPA:
            self.baseline_kpa = self._rest_kpa = smoothed_kpa
            fast_kpa, slow_kpa = self._averages_kpa
            self._averages_kpa = fast_kpa + change_kpa, slow_kpa + change_kpa

    def _measure_drift(self, smoothed_kpa: float, dt_s: float) -> None:
        if self._past_drift_s < 0:
            is_cold = self.gas_heat.dip_kpa > AT_REST_KPA
            self._past_drift_s = min(self._past_drift_s + dt_s, -dt_s if is_cold else 0.0)
            self._set_averages(smoothed_kpa)
            return
        fast_s, slow_s = DRIFT_TIME_CONSTANTS_S
        fast_kpa, slow_kpa = self._averages_kpa
        fast_kpa += (smoothed_kpa - fast_kpa) * min(dt_s / fast_s, 1.0)
        slow_kpa += (smoothed_kpa - slow_kpa) * min(dt_s / slow_s, 1.0)
        self._averages_kpa = fast_kpa, slow_kpa
        self.drift_kpa_per_s = (fast_kpa - slow_kpa) / (slow_s - fast_s)
        step_kpa_per_s = self.drift_kpa_per_s - self._mean_drift_kpa_per_s
        self._mean_drift_kpa_per_s += step_kpa_per_s * min(dt_s / LEAK_TIME_CONSTANT_S, 1.0)
        self._past_drift_s += dt_s
        if self._past_drift_s >= DRIFT_DELAY_S:
            self._past_drift_s = 0.0
            self._past_drifts = self._past_drifts[1], (self.drift_kpa_per_s, self._mean_drift_kpa_per_s)

    def _restart_drift(self, smoothed_kpa: float, drift_kpa_per_s: float, mean_kpa_per_s: float) -> None:
        """Restart the measurement of the drift at a known drift, after the pressure has settled."""
        self.drift_kpa_per_s, self._mean_drift_kpa_per_s = drift_kpa_per_s, mean_kpa_per_s
        self._past_drifts = ((drift_kpa_per_s, mean_kpa_per_s),) * 2
        self._past_drift_s = -SETTLING_S
        self._set_averages(smoothed_kpa)

    def _set_averages(self, smoothed_kpa: float) -> None:
        """Set the averages to those of a steady drift that has reached `smoothed_kpa`."""
        fast_s, slow_s = DRIFT_TIME_CONSTANTS_S
        drift_kpa_per_s = self.drift_kpa_per_s
        self._averages_kpa = smoothed_kpa - drift_kpa_per_s * fast_s, smoothed_kpa - drift_kpa_per_s * slow_s

    def _start_first_contact(self, now_kpa: float, smoothed_kpa: float) -> None:
        """Start a contact of a free balloon. ΔP_i is the baseline at the last rest."""
        self.drift_kpa_per_s, past_mean_kpa_per_s = self._past_drifts[0]
        # The beginning of a contact can only raise the mean, so the lower mean is the better one.
        self._mean_drift_kpa_per_s = min(self._mean_drift_kpa_per_s, past_mean_kpa_per_s)
        self.unexplained.move_baseline(self._rest_kpa - self.baseline_kpa)
        self.unexplained.start_contact(self._rest_kpa, self._rest_s)
        self._start_contact(self._rest_kpa, now_kpa, smoothed_kpa)

    def _start_contact(self, baseline_kpa: float, now_kpa: float, smoothed_kpa: float) -> None:
        self.in_contact = True
        self.contact_count += 1
        self.baseline_kpa = baseline_kpa
        self._extremes = ContactExtremes.start(now_kpa, smoothed_kpa)

    def _step_contact(self, smoothed_kpa: float, now_kpa: float, dt_s: float) -> None:
        self.baseline_age_s += dt_s
        self.baseline_kpa += self.leak_kpa_per_s * dt_s
        self.unexplained.follow_contact(smoothed_kpa, self.baseline_kpa, dt_s)
        released_kpa = RELEASE_RATIO * (self._extremes.peak_kpa - self.baseline_kpa)
        above_kpa = smoothed_kpa - self.baseline_kpa
        if above_kpa - END_KPA < min(released_kpa, self._warming_kpa):
            # If ΔP_i was lowered by a leak that has ended, a contact can continue below the present pressure.
            leaked_kpa = -self.leak_kpa_per_s * self.baseline_age_s
            # The amount of gas has not changed. Until it is warm, ΔP_i is known better than the pressure.
            dip_kpa = self.gas_heat.dip_kpa
            kept_kpa = min(max(above_kpa, -dip_kpa), dip_kpa) if above_kpa <= END_KPA else 0.0
            change_kpa = above_kpa - kept_kpa
            self._end_contact(change_kpa + (leaked_kpa if leaked_kpa > released_kpa else 0.0))
            self.baseline_kpa = self._rest_kpa = self.baseline_kpa + change_kpa
            self._restart_drift(smoothed_kpa, self.drift_kpa_per_s, self._mean_drift_kpa_per_s)
            return
        if self._extremes.step(now_kpa, smoothed_kpa, self.baseline_kpa):
            self.finished_count += 1
            self._start_contact(self.baseline_kpa, now_kpa, smoothed_kpa)

    @property
    def _warming_kpa(self) -> float:
        """Return the rise of the baseline [kPa] since the contact began.

        The rise is an estimate: the drift before the contact is assumed to continue and to fade.
        """
        drift_kpa_per_s = min(max(self.drift_kpa_per_s, 0.0), MAX_TRACKING_KPA_PER_S)
        faded_age_s = -math.expm1(-self.baseline_age_s / WARMING_TIME_CONSTANT_S)
        return drift_kpa_per_s * WARMING_TIME_CONSTANT_S * faded_age_s

    def _end_contact(self, change_kpa: float) -> None:
        """End the contact. The new baseline differs from ΔP_i by `change_kpa`."""
        self.in_contact = False
        self.finished_count += 1
        self.unexplained.end_contact(change_kpa)
