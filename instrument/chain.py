"""The chain: one rig sample in, one measurement out."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

from instrument.contact import ONSET_KPA, ContactTracker
from instrument.lag import LagCompensator
from instrument.leak import LeakWatch
from instrument.measurement import Measurement, Quality
from instrument.model import LIVE, Balloon, Circuit, Correction, Law
from instrument.model.balloon import LOWEST_RISE_KPA, VALID_HIGH_KPA, VALID_LOW_KPA
from instrument.model.curve import ContactCurve, Point
from instrument.model.uncertainty import InputErrors, ModelErrors, Pressures, std_n
from instrument.rig.frames import BoardState
from instrument.rig.limits import alive, nominal_pressure_kpa
from instrument.rig.link import RawSample
from instrument.sensor import Zero

#: What is shown of a free balloon (lower limit, detection limit) need not follow its baseline more closely.
SAME_BASELINE_KPA = 0.01
#: ΔP_i moves under a contact with the leak that was seen before it: the law is solved anew after this much.
SAME_CONTACT_KPA = 0.002


@dataclass(frozen=True, slots=True, kw_only=True)
class ChainSettings:
    """What turns counts into newtons."""

    balloon: Balloon = field(default_factory=Balloon)
    circuit: Circuit = field(default_factory=Circuit)
    law: Law = LIVE
    correction: Correction | None = None
    errors: InputErrors = field(default_factory=InputErrors)
    model: ModelErrors = field(default_factory=ModelErrors)
    #: Time constant of the first-order exponential filter of the pressure that is shown.
    filter_s: float = 0.06
    tube_s: float = 0.06  #: lag between balloon and sensor
    lag_share: float = 0.15  #: its standard uncertainty, as a share of it


@dataclass(slots=True)
class Chain:
    """Counts → kPa → zero → filter → contact → force. Holds what must be remembered between samples."""

    settings: ChainSettings
    zero: Zero = field(default_factory=Zero)
    tracker: ContactTracker = field(default_factory=ContactTracker)
    leak: LeakWatch = field(default_factory=LeakWatch)
    reference_kpa: float = 0.0  #: pressure around the balloon above ambient
    _lag: LagCompensator = field(init=False)
    _filtered_kpa: float = math.nan  # before the zero
    _curve: tuple[ContactCurve, float] | None = None

    def __post_init__(self) -> None:
        self._lag = LagCompensator(self.settings.tube_s)

    @property
    def delay_s(self) -> float:
        """What remains of the force's delay [s]."""
        return self._lag.delay_s

    def uncalibrate(self) -> None:
        """Another balloon is fitted: the bare law from now on, with the uncertainty of an unknown balloon."""
        own = self.settings
        model = ModelErrors.of(own.law.method)
        self.settings = replace(own, correction=None, errors=InputErrors(), model=model)
        self._curve = None

    def step(self, sample: RawSample) -> Measurement:
        """The measurement of one sample. Never raises on what a sensor may read: NaN and `quality` say it."""
        message, dt_s = sample.message, sample.elapsed_s
        if sample.frozen or not alive(message.adc_sum):
            return self._blind(sample)
        nominal_kpa = nominal_pressure_kpa(message.adc_sum)
        self._filter(nominal_kpa, dt_s)
        self.zero.observe(self._filtered_kpa, message.state == BoardState.VENTED, dt_s)
        zero_kpa = self.zero.zero_kpa if self.zero.taken else 0.0
        now_kpa = self._lag.step(nominal_kpa, dt_s) - zero_kpa
        locked = message.state == BoardState.HOLDING and self.zero.taken
        self.tracker.step(self._lag.calm_kpa - zero_kpa, now_kpa, locked, dt_s)
        free = locked and not self.tracker.in_contact
        self.leak.step(message.setpoint_pa, free, self.tracker.initial_kpa, dt_s)
        pressure_kpa, unfiltered_kpa = self._filtered_kpa - zero_kpa, nominal_kpa - zero_kpa
        if not locked:
            why = Quality.NOT_HOLDING if self.zero.taken else Quality.NOT_HOLDING | Quality.NOT_ZEROED
            return Measurement(
                t_s=sample.t_s, pressure_kpa=pressure_kpa, unfiltered_kpa=unfiltered_kpa, quality=why
            )
        if self.tracker.in_contact:
            return self._pressed(sample.t_s, pressure_kpa, unfiltered_kpa, now_kpa)
        return self._free(sample.t_s, pressure_kpa, unfiltered_kpa)

    def _blind(self, sample: RawSample) -> Measurement:
        """A sample that tells nothing. Some of them do not end a contact; more trip the board."""
        dt_s = sample.elapsed_s
        self._filtered_kpa = math.nan
        self._lag.step(math.nan, dt_s)
        self.zero.observe(math.nan, False, dt_s)
        if sample.message.state == BoardState.HOLDING:
            self.tracker.blind(dt_s)
        else:
            self.tracker.step(math.nan, math.nan, False, dt_s)
        return Measurement(t_s=sample.t_s, quality=Quality.SENSOR)

    def _filter(self, nominal_kpa: float, dt_s: float) -> None:
        if not math.isfinite(self._filtered_kpa):
            self._filtered_kpa = nominal_kpa
        share = -math.expm1(-dt_s / self.settings.filter_s)
        self._filtered_kpa += share * (nominal_kpa - self._filtered_kpa)

    def _free(self, t_s: float, pressure_kpa: float, unfiltered_kpa: float) -> Measurement:
        """Zeros; the uncertainty is the detection limit, the force at the onset threshold.

        Where the baseline is lost there is no force.
        """
        initial_kpa = self.tracker.initial_kpa
        if self.tracker.lost:
            return Measurement(
                t_s=t_s,
                pressure_kpa=pressure_kpa,
                unfiltered_kpa=unfiltered_kpa,
                initial_kpa=initial_kpa,
                quality=Quality.NO_BASELINE,
            )
        curve, onset_n = self._curve_at(initial_kpa - self.reference_kpa, SAME_BASELINE_KPA)
        return Measurement(
            t_s=t_s,
            pressure_kpa=pressure_kpa,
            unfiltered_kpa=unfiltered_kpa,
            initial_kpa=initial_kpa,
            rise_kpa=0.0,
            radius_mm=self.settings.balloon.radius_mm(initial_kpa - self.reference_kpa),
            indentation_mm=0.0,
            contact_radius_mm=0.0,
            force_n=0.0,
            force_std_n=onset_n,
            force_uncompensated_n=0.0,
            force_low_n=curve.low_n,
        )

    def _pressed(self, t_s: float, pressure_kpa: float, unfiltered_kpa: float, now_kpa: float) -> Measurement:
        initial_kpa = self.tracker.initial_kpa
        curve, _ = self._curve_at(initial_kpa - self.reference_kpa, SAME_CONTACT_KPA)
        rise_kpa = now_kpa - initial_kpa
        force_n = std = math.nan
        point, quality = curve.at(rise_kpa), Quality.GOOD
        if not VALID_LOW_KPA <= curve.initial_kpa <= VALID_HIGH_KPA:
            quality = Quality.OUT_OF_RANGE
        elif not math.isfinite(point.estimate.force_n):
            quality = Quality.NO_SOLUTION
        else:
            quality = Quality.INTERPOLATED if rise_kpa < LOWEST_RISE_KPA else Quality.GOOD
            force_n, std = point.estimate.force_n, self._std_n(point, curve.initial_kpa, rise_kpa)
        known = math.isfinite(force_n)
        return Measurement(
            t_s=t_s,
            pressure_kpa=pressure_kpa,
            unfiltered_kpa=unfiltered_kpa,
            initial_kpa=initial_kpa,
            rise_kpa=rise_kpa,
            radius_mm=self.settings.balloon.radius_mm(curve.initial_kpa),
            indentation_mm=point.estimate.indentation_mm if known else math.nan,
            contact_radius_mm=point.estimate.contact_radius_mm if known else math.nan,
            force_n=force_n,
            force_std_n=std,
            force_uncompensated_n=curve.force_n(pressure_kpa - initial_kpa),
            force_low_n=curve.low_n,
            in_contact=True,
            quality=quality,
        )

    def _std_n(self, point: Point, initial_kpa: float, rise_kpa: float) -> float:
        own, tracker, lag = self.settings, self.tracker, self._lag
        final_kpa, age_s = initial_kpa + rise_kpa, tracker.baseline_age_s
        moving_kpa = math.hypot(lag.noise_kpa, own.lag_share * own.tube_s * lag.rate_kpa_per_s)
        initial_std_kpa = own.errors.initial_std_kpa(age_s, tracker.drifted_kpa)
        known = Pressures(initial_kpa, final_kpa, initial_std_kpa, moving_kpa)
        return std_n(point.estimate.force_n, point.spread, known, own.errors, own.model, own.balloon)

    def _curve_at(self, initial_kpa: float, within_kpa: float = 0.0) -> tuple[ContactCurve, float]:
        """The law at one ΔP_i and its force at the onset threshold, kept while ΔP_i stays `within_kpa`."""
        own, kept = self.settings, self._curve
        ambient_kpa = own.circuit.ambient_kpa + self.reference_kpa
        if (
            kept is None
            or not abs(kept[0].initial_kpa - initial_kpa) <= within_kpa
            or kept[0].circuit.ambient_kpa != ambient_kpa
        ):
            circuit = replace(own.circuit, ambient_kpa=ambient_kpa)
            curve = ContactCurve(initial_kpa, own.balloon, circuit, own.law, own.correction, own.errors)
            kept = self._curve = curve, curve.at(ONSET_KPA).estimate.force_n
        return kept
