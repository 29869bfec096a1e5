"""Force correction: the result of a calibration of one balloon against a reference force sensor."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from pneuforce.instrument.model.balloon import Balloon, Number, clamp
from pneuforce.instrument.model.law import PAPER_LAW, ForceLaw
from pneuforce.instrument.model.pressure_bins import (
    CoveredSpans,
    RiseSpans,
    are_covered,
    covered_spans,
    pressure_bin_index,
)
from pneuforce.instrument.model.uncertainty import InputUncertainties

#: ΔP_i at which the variable p of `ForceCorrection` is zero [kPa].
REFERENCE_BASELINE_KPA = 8.0
#: Imaginary step of the complex-step derivative. Its square is negligible compared with 1.
COMPLEX_STEP = 1e-20


@dataclass(frozen=True, slots=True, kw_only=True)
class ForceCorrection:
    """Correction F = F_law · exp(constant + by_rise L + by_initial p + by_both L p + by_step w).

    L is ln(rise / 1 kPa) and p is ΔP_i − 8 kPa. w is the weight of stretching energy (4) in the force law at
    ΔP_i, so that `by_step` can remove the step of the law at 8.85 kPa. Nothing is extrapolated: a rise or a
    ΔP_i outside the calibrated span is replaced by the nearest end of the span.
    """

    constant: float
    by_rise: float
    by_initial: float  #: coefficient of p [1/kPa]
    by_both: float  #: coefficient of L p [1/kPa]
    rise_span_kpa: tuple[float, float]  #: calibrated span of the rise
    baseline_span_kpa: tuple[float, float]  #: calibrated span of ΔP_i
    #: Span of the rise of the contacts in each pressure bin. None: `rise_span_kpa` in each bin.
    rise_spans_by_bin: RiseSpans | None = None
    by_step: float = 0.0
    law: ForceLaw = PAPER_LAW  #: the force law that is corrected
    balloon: Balloon = field(default_factory=Balloon)
    #: Uncertainties of the inputs where there are no contacts. None: the same as where there are contacts.
    outside: InputUncertainties | None = None

    @property
    def covered_spans(self) -> CoveredSpans:
        """Return the pressures in each pressure bin that the contacts represent."""
        span = self.rise_span_kpa
        return covered_spans(self.rise_spans_by_bin or (span, span, span, span, span), self.baseline_span_kpa)

    def covers(self, rise_kpa: float, baseline_kpa: float) -> bool:
        """Return True if the contacts of the calibration represent these pressures."""
        return are_covered(self.covered_spans, baseline_kpa, rise_kpa)

    def largest_rise_kpa(self, baseline_kpa: float) -> float:
        """Return the largest rise [kPa] that the contacts of the calibration represent, 0 if none."""
        span = self.covered_spans[pressure_bin_index(baseline_kpa)]
        return span.rise_span_kpa[1] if span and self.covers(span.rise_span_kpa[1], baseline_kpa) else 0.0

    def factor(self, rise_kpa: Number, baseline_kpa: Number) -> Number:
        """Return the factor that multiplies the force of the law. The arguments are floats or arrays."""
        baseline = clamp(baseline_kpa, *self.baseline_span_kpa)
        rise, p = clamp(rise_kpa, *self.rise_span_kpa), baseline - REFERENCE_BASELINE_KPA
        w = self.law.small_strain_weight(baseline, self.balloon)
        exponent = self.constant + self.by_initial * p + self.by_step * w
        return math.e**exponent * rise ** (self.by_rise + self.by_both * p)

    def log_slopes_per_kpa(self, rise_kpa: float, baseline_kpa: float) -> tuple[float, float]:
        """Return the partial derivatives of ln(factor) with respect to ΔP_i and to ΔP_f [1/kPa]."""
        low, high = self.rise_span_kpa
        rise = clamp(rise_kpa, low, high)
        p = clamp(baseline_kpa, *self.baseline_span_kpa) - REFERENCE_BASELINE_KPA
        by_rise = (self.by_rise + self.by_both * p) / rise if low <= rise_kpa <= high else 0.0
        low, high = self.baseline_span_kpa
        if not low <= baseline_kpa <= high:
            return -by_rise, by_rise
        w = self.law.small_strain_weight(complex(baseline_kpa, COMPLEX_STEP), self.balloon)
        by_baseline = self.by_initial + self.by_both * math.log(rise) + self.by_step * w.imag / COMPLEX_STEP
        return by_baseline - by_rise, by_rise
