"""The chain: one rig sample in, one measurement out."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from instrument.contact import ONSET_KPA, ContactTracker
from instrument.measurement import Measurement, Quality
from instrument.model import Balloon, Circuit, Estimate, contact, on_the_line
from instrument.model.balloon import LOWEST_RISE_KPA, VALID_HIGH_KPA, VALID_LOW_KPA
from instrument.model.uncertainty import InputErrors, LowEnd, sensitivities
from instrument.rig.frames import BoardState
from instrument.rig.limits import alive, nominal_pressure_kpa
from instrument.rig.link import RawSample
from instrument.sensor import Zero


@dataclass(frozen=True, slots=True, kw_only=True)
class ChainSettings:
    """What turns counts into newtons."""

    balloon: Balloon = field(default_factory=Balloon)
    circuit: Circuit = field(default_factory=Circuit)
    errors: InputErrors = field(default_factory=InputErrors)
    method: str = "energetic"
    filter_s: float = 0.06  #: time constant of the first-order exponential filter
    tube_s: float = 0.06  #: lag between balloon and sensor

    @property
    def delay_s(self) -> float:
        """Delay of the force [s]: 0.12 s, as the paper found, with the values given here."""
        return self.filter_s + self.tube_s


@dataclass(slots=True)
class Chain:
    """Counts → kPa → zero → filter → contact → force. Holds what must be remembered between samples."""

    settings: ChainSettings
    zero: Zero = field(default_factory=Zero)
    tracker: ContactTracker = field(default_factory=ContactTracker)
    reference_kpa: float = 0.0  #: pressure around the balloon above ambient
    _filtered_kpa: float = math.nan  # before the zero
    _low_end: tuple[tuple[float, float], LowEnd] | None = None

    def step(self, sample: RawSample) -> Measurement:
        """The measurement of one sample. Never raises on what a sensor may read: NaN and `quality` say it."""
        message, dt_s = sample.message, sample.elapsed_s
        if sample.frozen or not alive(message.adc_sum):
            self._filtered_kpa = math.nan
            self.zero.observe(math.nan, False, dt_s)
            self.tracker.step(math.nan, False, dt_s)
            return Measurement(t_s=sample.received_s, quality=Quality.SENSOR)
        nominal_kpa = nominal_pressure_kpa(message.adc_sum)
        self._filter(nominal_kpa, dt_s)
        self.zero.observe(self._filtered_kpa, message.state == BoardState.VENTED, dt_s)
        zero_kpa = self.zero.zero_kpa if self.zero.taken else 0.0
        pressure_kpa = self._filtered_kpa - zero_kpa
        locked = message.state == BoardState.HOLDING and self.zero.taken
        self.tracker.step(pressure_kpa, locked, dt_s)
        return self._measure(sample.received_s, pressure_kpa, nominal_kpa - zero_kpa, locked)

    def _filter(self, nominal_kpa: float, dt_s: float) -> None:
        if not math.isfinite(self._filtered_kpa):
            self._filtered_kpa = nominal_kpa
        share = -math.expm1(-dt_s / self.settings.filter_s)
        self._filtered_kpa += share * (nominal_kpa - self._filtered_kpa)

    def _measure(self, t_s: float, pressure_kpa: float, unfiltered_kpa: float, locked: bool) -> Measurement:
        if not locked:
            why = Quality.NOT_HOLDING if self.zero.taken else Quality.NOT_HOLDING | Quality.NOT_ZEROED
            return Measurement(t_s=t_s, pressure_kpa=pressure_kpa, unfiltered_kpa=unfiltered_kpa, quality=why)
        initial_kpa = self.tracker.initial_kpa - self.reference_kpa
        final_kpa = pressure_kpa - self.reference_kpa
        solved, std_n, low_n, quality = (
            self._pressed(initial_kpa, final_kpa) if self.tracker.in_contact else self._free(initial_kpa)
        )
        return Measurement(
            t_s=t_s,
            pressure_kpa=pressure_kpa,
            unfiltered_kpa=unfiltered_kpa,
            initial_kpa=self.tracker.initial_kpa,
            rise_kpa=final_kpa - initial_kpa if self.tracker.in_contact else 0.0,
            radius_mm=solved.radius_mm,
            indentation_mm=solved.indentation_mm,
            contact_radius_mm=solved.contact_radius_mm,
            force_n=solved.force_n,
            force_std_n=std_n,
            force_low_n=low_n,
            in_contact=self.tracker.in_contact,
            quality=quality,
        )

    @property
    def _circuit(self) -> Circuit:
        own = self.settings.circuit
        return Circuit(volume_mm3=own.volume_mm3, ambient_kpa=own.ambient_kpa + self.reference_kpa)

    def _free(self, initial_kpa: float) -> tuple[Estimate, float, float, Quality]:
        """Zeros; the uncertainty is the detection limit, the force at the onset threshold."""
        radius_mm = self.settings.balloon.radius_mm(initial_kpa)
        low_n = self._low_end_at(round(initial_kpa, 2)).estimate.force_n
        nothing = Estimate(0.0, 0.0, 0.0, radius_mm, radius_mm)
        return nothing, low_n * ONSET_KPA / LOWEST_RISE_KPA, low_n, Quality.GOOD

    def _pressed(self, initial_kpa: float, final_kpa: float) -> tuple[Estimate, float, float, Quality]:
        own, circuit = self.settings, self._circuit
        low_end = self._low_end_at(initial_kpa)
        low_n = low_end.estimate.force_n
        if not VALID_LOW_KPA <= initial_kpa <= VALID_HIGH_KPA:
            radius_mm = own.balloon.radius_mm(initial_kpa)
            nothing = Estimate(math.nan, math.nan, math.nan, radius_mm, math.nan)
            return nothing, math.nan, low_n, Quality.OUT_OF_RANGE
        rise_kpa = final_kpa - initial_kpa
        if rise_kpa < LOWEST_RISE_KPA:
            solved, by_input = on_the_line(low_end.estimate, rise_kpa, final_kpa), low_end.at(rise_kpa)
            quality = Quality.INTERPOLATED
        else:
            solved = contact(initial_kpa, final_kpa, own.balloon, circuit, own.method)
            d = solved.indentation_mm
            by_input = sensitivities(initial_kpa, final_kpa, d, own.balloon, circuit, own.method)
            quality = Quality.GOOD
        if not math.isfinite(solved.force_n):
            return solved, math.nan, low_n, Quality.NO_SOLUTION
        return solved, by_input.std_n(initial_kpa, final_kpa, own.errors), low_n, quality

    def _low_end_at(self, initial_kpa: float) -> LowEnd:
        """Where the line to zero ends, solved once for each ΔP_i."""
        key = (initial_kpa, self.reference_kpa)
        if self._low_end is None or self._low_end[0] != key:
            own = self.settings
            self._low_end = (key, LowEnd.of(initial_kpa, own.balloon, self._circuit, own.method))
        return self._low_end[1]
