"""Measuring chain: computes one measurement from each sample of the rig."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

from pneuforce.instrument.measurement.ambient import AmbientPressure
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.measurement.contact import ONSET_KPA, ContactTracker
from pneuforce.instrument.measurement.lag import LagCompensator
from pneuforce.instrument.measurement.leak import LeakMonitor
from pneuforce.instrument.measurement.measurement import WITH_FORCE, Measurement, Quality
from pneuforce.instrument.measurement.proof_test import ProofTest, Verdict
from pneuforce.instrument.measurement.unexplained_force import HiddenPress, unexplained_std_n
from pneuforce.instrument.measurement.zero import ZeroAdjustment
from pneuforce.instrument.model.balloon import VALID_HIGH_KPA, VALID_LOW_KPA
from pneuforce.instrument.model.curve import ContactCurve
from pneuforce.instrument.model.curve_segment import ForceCurvePoint
from pneuforce.instrument.model.force_model import ForceModel
from pneuforce.instrument.model.law import ForceLaw
from pneuforce.instrument.model.uncertainty import MeasuredPressures, force_std_n
from pneuforce.instrument.rig.link import RawSample
from pneuforce.protocol.frames import BoardState
from pneuforce.protocol.limits import HELD, PRESSURISED, adc_sum_is_valid, nominal_pressure_kpa

#: Change of ΔP_i after which the force curve of a free balloon is computed again. Only the lower range limit
#: and the detection limit depend on this curve.
FREE_CURVE_TOLERANCE_KPA = 0.01
#: Change of ΔP_i after which the force curve is computed again during a contact. ΔP_i falls slowly if the
#: balloon leaks.
CONTACT_CURVE_TOLERANCE_KPA = 0.002
#: Change of the pressure around a held balloon that is ignored. The locked pressure changes by about half of
#: this value, which is below the rise at which a contact is detected.
REFERENCE_TOLERANCE_KPA = 0.1


@dataclass(slots=True)
class Chain:
    """Measuring chain with its state.

    Its stages: conversion to kPa, filter, zero adjustment, lag compensation, contact tracking, force.
    """

    settings: ChainSettings
    zero: ZeroAdjustment = field(default_factory=ZeroAdjustment)
    tracker: ContactTracker = field(default_factory=ContactTracker)
    leak: LeakMonitor = field(default_factory=LeakMonitor)
    proof_test: ProofTest = field(default_factory=ProofTest)
    ambient: AmbientPressure = field(default_factory=AmbientPressure)
    reference_kpa: float = 0.0  #: pressure around the balloon above ambient (insufflation)
    _lag: LagCompensator = field(init=False)
    #: Force model of the settings. It is built once, because its table may have to be computed.
    _model: ForceModel | None = field(default=None, metadata={"state": False})
    _filtered_kpa: float = math.nan  # filtered pressure before the zero is subtracted
    _curve_baseline_kpa: float = math.nan  # ΔP_i of the cached force curve; NaN if no curve is valid
    #: Pressure around the balloon of the cached force curve, whether P_0 is measured, and whether recently.
    _curve_ambient: tuple[float, bool, bool] = (math.nan, False, False)
    #: Cached force curve, and its force at the contact onset. Both follow from the values above.
    _curve: tuple[ContactCurve, float] | None = field(default=None, metadata={"state": False})
    #: Cached uncertainty, which follows from the settings, the curve and the unexplained rise.
    _hidden_press: HiddenPress = field(default_factory=HiddenPress, metadata={"state": False})

    def __post_init__(self) -> None:
        self._lag = LagCompensator(self.settings.tube_time_constant_s)
        self._model = self.settings.force_model

    @property
    def delay_s(self) -> float:
        """Return the delay [s] that the force still has after the lag compensation."""
        return self._lag.delay_s

    @property
    def largest_rise_kpa(self) -> float:
        """Return the rise [kPa] above which the balloon may be pressed flat, NaN without a baseline."""
        if not math.isfinite(self._curve_baseline_kpa):
            return math.nan
        self._curve = self._curve or self._compute_curve()
        return self._curve[0].largest_rise_kpa

    def remove_calibration(self) -> None:
        """Remove the force calibration, because another balloon is fitted.

        The uncertainty becomes that of an unknown balloon.
        """
        settings = self.settings
        unknown = ChainSettings.of(replace(settings.law, grip=ForceLaw().grip))
        self.settings = replace(
            settings,
            law=unknown.law,
            correction=None,
            input_uncertainties=unknown.input_uncertainties,
            model_uncertainty=unknown.model_uncertainty,
        )
        self._curve_baseline_kpa, self._model = math.nan, None

    def change_settings(self, settings: ChainSettings) -> None:
        """Continue with other settings, for example to evaluate a recording with another calibration.

        The zero adjustment and the contact in progress remain. If the time constant of the tube changes, the
        lag compensation restarts.
        """
        if settings == self.settings:
            return
        if settings.tube_time_constant_s != self.settings.tube_time_constant_s:
            self._lag = LagCompensator(settings.tube_time_constant_s)
        self.settings, self._model = settings, settings.force_model
        self._curve_baseline_kpa, self._hidden_press = math.nan, HiddenPress()

    def proof_test_verdict(self, sample: RawSample) -> Verdict | None:
        """Return the verdict of a proof test at the first sample after it, otherwise None.

        Call this method once for each sample.
        """
        message = sample.message
        valid = not sample.clock_invalid and adc_sum_is_valid(message.adc_sum)
        reading_kpa = nominal_pressure_kpa(message.adc_sum) if valid else math.nan
        response = self.proof_test.step(message, reading_kpa, sample.elapsed_s)
        if response is None:
            return None
        return self.proof_test.judge(response, self.settings.balloon, self.settings.circuit)

    def step(self, sample: RawSample) -> Measurement:
        """Return the measurement of one sample.

        This method never raises. An invalid reading gives NaN, and `quality` gives the reason.
        """
        message, dt_s = sample.message, sample.elapsed_s
        if sample.clock_invalid or not adc_sum_is_valid(message.adc_sum):
            return self._step_invalid(sample)
        if message.state not in PRESSURISED:
            self.tracker.empty()
        nominal_kpa = nominal_pressure_kpa(message.adc_sum)
        self._filter(nominal_kpa, dt_s)
        self.zero.observe(self._filtered_kpa, message.state == BoardState.VENTED, dt_s)
        zero_kpa = self.zero.zero_kpa if self.zero.taken else 0.0
        now_kpa = self._lag.step(nominal_kpa, dt_s) - zero_kpa
        locked = message.state == BoardState.HOLDING and self.zero.taken
        testing = message.state == BoardState.TESTING and self.zero.taken
        if testing:
            self.tracker.pause(dt_s)
        else:
            self.tracker.step(self._lag.smoothed_kpa - zero_kpa, now_kpa, locked, dt_s)
        free = locked and not self.tracker.in_contact
        self.leak.step(message.setpoint_pa, free, self.tracker.baseline_kpa, dt_s)
        pressure_kpa, unfiltered_kpa = self._filtered_kpa - zero_kpa, nominal_kpa - zero_kpa
        if not locked:
            quality = Quality.TESTING if testing else Quality.NOT_HOLDING
            if not self.zero.taken:
                quality |= Quality.NOT_ZEROED
            return Measurement(
                t_s=sample.t_s, pressure_kpa=pressure_kpa, unfiltered_kpa=unfiltered_kpa, quality=quality
            )
        if self.tracker.in_contact:
            return self._measure_contact(sample.t_s, pressure_kpa, unfiltered_kpa, now_kpa)
        return self._measure_free(sample.t_s, pressure_kpa, unfiltered_kpa)

    def check_reference(self, reference_kpa: float) -> None:
        """Lose the baseline if the pressure around the inflated balloon has changed to `reference_kpa`.

        The locked pressure then contains the change, and no later reading separates the change from a force.
        """
        if not abs(reference_kpa - self.reference_kpa) <= REFERENCE_TOLERANCE_KPA:
            self.tracker.baseline_lost = True

    def _step_invalid(self, sample: RawSample) -> Measurement:
        """Return the measurement of a sample without a valid reading.

        A few invalid samples do not end a contact. After more invalid samples the board trips.
        """
        dt_s = sample.elapsed_s
        self._filtered_kpa = math.nan
        self._lag.step(math.nan, dt_s)
        self.zero.observe(math.nan, False, dt_s)
        if sample.message.state in HELD:
            self.tracker.skip(dt_s)
        else:
            self.tracker.step(math.nan, math.nan, False, dt_s)
        return Measurement(t_s=sample.t_s, quality=Quality.SENSOR_FAULT)

    def _filter(self, nominal_kpa: float, dt_s: float) -> None:
        if not math.isfinite(self._filtered_kpa):
            self._filtered_kpa = nominal_kpa
        response = -math.expm1(-dt_s / self.settings.filter_time_constant_s)
        self._filtered_kpa += response * (nominal_kpa - self._filtered_kpa)

    def _measure_free(self, t_s: float, pressure_kpa: float, unfiltered_kpa: float) -> Measurement:
        """Return the measurement of a balloon without contact. Its force is zero.

        The uncertainty is the detection limit: the force at the onset of a contact, or half the force that a
        slow press can have, whichever is larger. If the baseline is unknown or outside the range of the
        model, the force is NaN.
        """
        baseline_kpa = self.tracker.baseline_kpa
        if self.tracker.baseline_unknown:
            return Measurement(
                t_s=t_s,
                pressure_kpa=pressure_kpa,
                unfiltered_kpa=unfiltered_kpa,
                baseline_kpa=baseline_kpa,
                quality=Quality.NO_BASELINE,
            )
        curve, onset_n = self._curve_at(baseline_kpa - self.reference_kpa, FREE_CURVE_TOLERANCE_KPA)
        hidden_n = self._hidden_press.std_n(curve, self.tracker.hidden_kpa, self.settings.model_uncertainty)
        limit_n = max(onset_n, hidden_n) if math.isfinite(onset_n + hidden_n) else math.nan
        in_range = VALID_LOW_KPA <= curve.baseline_kpa <= VALID_HIGH_KPA and math.isfinite(limit_n)
        return Measurement(
            t_s=t_s,
            pressure_kpa=pressure_kpa,
            unfiltered_kpa=unfiltered_kpa,
            baseline_kpa=baseline_kpa,
            rise_kpa=0.0,
            radius_mm=self.settings.balloon.radius_mm(baseline_kpa - self.reference_kpa),
            indentation_mm=0.0,
            contact_radius_mm=0.0,
            force_n=0.0 if in_range else math.nan,
            force_std_n=limit_n if in_range else math.nan,
            force_uncompensated_n=0.0,
            force_lower_range_limit_n=curve.lower_range_limit_n,
            quality=Quality.GOOD if in_range else Quality.OUT_OF_RANGE,
        )

    def _measure_contact(
        self, t_s: float, pressure_kpa: float, unfiltered_kpa: float, now_kpa: float
    ) -> Measurement:
        baseline_kpa = self.tracker.baseline_kpa
        curve, _ = self._curve_at(baseline_kpa - self.reference_kpa, CONTACT_CURVE_TOLERANCE_KPA)
        rise_kpa = now_kpa - baseline_kpa
        point = curve.at(rise_kpa)
        force_n, std_n = point.estimate.force_n, self._std_n(point, curve, rise_kpa)
        if self.tracker.baseline_unknown:
            quality = Quality.NO_BASELINE
        elif not VALID_LOW_KPA <= curve.baseline_kpa <= VALID_HIGH_KPA:
            quality = Quality.OUT_OF_RANGE
        elif not math.isfinite(force_n + std_n):
            quality = Quality.NO_SOLUTION if point.plausible else Quality.OUT_OF_RANGE
        else:
            quality = Quality.INTERPOLATED if rise_kpa < curve.model.lower_range_rise_kpa else Quality.GOOD
        if rise_kpa > curve.largest_rise_kpa:
            quality |= Quality.FLAT
        has_force = quality in WITH_FORCE
        return Measurement(
            t_s=t_s,
            pressure_kpa=pressure_kpa,
            unfiltered_kpa=unfiltered_kpa,
            baseline_kpa=baseline_kpa,
            rise_kpa=rise_kpa,
            radius_mm=self.settings.balloon.radius_mm(curve.baseline_kpa),
            indentation_mm=point.estimate.indentation_mm if has_force else math.nan,
            contact_radius_mm=point.estimate.contact_radius_mm if has_force else math.nan,
            force_n=force_n if has_force else math.nan,
            force_std_n=std_n if has_force else math.nan,
            force_uncompensated_n=curve.force_n(pressure_kpa - baseline_kpa),
            force_lower_range_limit_n=curve.lower_range_limit_n,
            in_contact=True,
            quality=quality,
        )

    def _std_n(self, point: ForceCurvePoint, curve: ContactCurve, rise_kpa: float) -> float:
        """Return the standard uncertainty [N] of the force at a point of the curve, NaN without a force."""
        settings, tracker, lag, baseline_kpa = self.settings, self.tracker, self._lag, curve.baseline_kpa
        inputs = settings.input_uncertainties
        lag_std_s = settings.lag_relative_std * settings.tube_time_constant_s
        pressures = MeasuredPressures(
            baseline_kpa,
            baseline_kpa + rise_kpa,
            inputs.baseline_std_kpa(tracker.baseline_age_s, tracker.drifted_kpa),
            math.hypot(lag.present_noise_kpa, lag_std_s * lag.rate_kpa_per_s),
            tracker.gas_heat.warm_share(tracker.baseline_kpa),
        )
        std_n = force_std_n(
            point.estimate.force_n, point.sensitivity, pressures, inputs, settings.model_uncertainty
        )
        return math.hypot(
            std_n, unexplained_std_n(curve, rise_kpa, tracker.hidden_kpa, tracker.unexplained.during_kpa)
        )

    def _curve_at(self, baseline_kpa: float, tolerance_kpa: float) -> tuple[ContactCurve, float]:
        """Return the force curve at one ΔP_i, and its force at the onset of a contact.

        The cached curve is returned while ΔP_i differs from its ΔP_i by at most `tolerance_kpa`.
        """
        around_kpa = self.ambient.kpa(self.settings) + self.reference_kpa
        ambient = around_kpa, self.ambient.is_measured, self.ambient.recent
        if not abs(self._curve_baseline_kpa - baseline_kpa) <= tolerance_kpa:
            self._curve_baseline_kpa, self._curve = baseline_kpa, None
        if self._curve_ambient != ambient:
            self._curve_ambient, self._curve = ambient, None
        if self._curve is None:
            self._curve = self._compute_curve()
        return self._curve

    def _compute_curve(self) -> tuple[ContactCurve, float]:
        self._model = self._model or self.settings.force_model
        model = self._model.at_ambient(self._curve_ambient[0])
        inputs = self.ambient.input_uncertainties(self.settings)
        curve = ContactCurve(self._curve_baseline_kpa, model, self.settings.correction, inputs)
        return curve, curve.at(ONSET_KPA).estimate.force_n
