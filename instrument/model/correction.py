"""A force calibration: what a reference force cell has taught about one balloon, on top of the law."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from instrument.model.balloon import Balloon, Number, within
from instrument.model.law import PAPER, Law

#: ΔP_i at which only `constant` and `by_rise` have an effect [kPa].
MIDDLE_KPA = 8.0
#: An imaginary step whose square vanishes beside 1: exact derivatives.
TINY = 1e-20


@dataclass(frozen=True, slots=True, kw_only=True)
class Correction:
    """F = F_law · exp(constant + by_rise L + by_initial p + by_both L p + by_step w).

    L is ln(rise / 1 kPa), p is ΔP_i − 8 kPa, and w the weight that the law gives to stretching energy (4) at
    ΔP_i: the step at 8.85 kPa is the law's own, and is taken back as it came. Outside the spans that were
    calibrated rise and ΔP_i count as at their ends: nothing is extrapolated.
    """

    constant: float
    by_rise: float
    by_initial: float  #: per kPa
    by_both: float  #: per kPa
    rise_span_kpa: tuple[float, float]
    initial_span_kpa: tuple[float, float]
    by_step: float = 0.0
    law: Law = PAPER  #: that is corrected
    balloon: Balloon = field(default_factory=Balloon)

    def factor(self, rise_kpa: Number, initial_kpa: Number) -> Number:
        """What the law's force is multiplied by; floats or arrays."""
        initial = within(initial_kpa, *self.initial_span_kpa)
        rise, p = within(rise_kpa, *self.rise_span_kpa), initial - MIDDLE_KPA
        w = self.law.small_strain(initial, self.balloon)
        exponent = self.constant + self.by_initial * p + self.by_step * w
        return math.e**exponent * rise ** (self.by_rise + self.by_both * p)

    def log_slopes_per_kpa(self, rise_kpa: float, initial_kpa: float) -> tuple[float, float]:
        """Derivatives of the factor's logarithm by ΔP_i (at one ΔP_f) and by ΔP_f [1/kPa]."""
        low, high = self.rise_span_kpa
        rise = within(rise_kpa, low, high)
        p = within(initial_kpa, *self.initial_span_kpa) - MIDDLE_KPA
        by_rise = (self.by_rise + self.by_both * p) / rise if low <= rise_kpa <= high else 0.0
        low, high = self.initial_span_kpa
        if not low <= initial_kpa <= high:
            return -by_rise, by_rise
        w = self.law.small_strain(complex(initial_kpa, TINY), self.balloon)
        by_initial = self.by_initial + self.by_both * math.log(rise) + self.by_step * w.imag / TINY
        return by_initial - by_rise, by_rise
