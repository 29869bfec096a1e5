"""Force model of the paper: the energetic method, and the methods of Lulevich and of Shanahan."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from pneuforce.instrument.model.balloon import MIN_RISE_KPA, Balloon, Circuit, Number
from pneuforce.instrument.model.derivatives import ContactDerivative, ContactDifferentiator, ModelInputs
from pneuforce.instrument.model.flat_balloon import fitted_skin, largest_rise_kpa
from pneuforce.instrument.model.force import ContactEstimate, solve_contact
from pneuforce.instrument.model.force_model import LargestContact, SolvedContact
from pneuforce.instrument.model.law import ForceLaw
from pneuforce.instrument.model.low_rise import estimate
from pneuforce.instrument.model.uncertainty import InputUncertainties, parameter_stds_n

_UNKNOWN_DERIVATIVE = ContactDerivative(math.nan, math.nan)


@dataclass(frozen=True, slots=True)
class PublishedModel:
    """Force model that solves the equations of a published method."""

    balloon: Balloon
    circuit: Circuit
    law: ForceLaw

    def __post_init__(self) -> None:
        fitted_skin(self.balloon)  # now, because the import and the fit would delay a measurement

    @property
    def is_consistent(self) -> bool:
        """Return True. The model has no data except the constants of balloon and circuit."""
        return True

    @property
    def lowest_rise_kpa(self) -> float:
        """Return the smallest rise at which the law is valid [kPa]."""
        return MIN_RISE_KPA

    @property
    def lower_range_rise_kpa(self) -> float:
        """Return the rise at the lower limit of the measuring range [kPa]."""
        return MIN_RISE_KPA

    def solve(self, baseline_kpa: float, rise_kpa: float) -> SolvedContact:
        """Return the contact at a rise of at least 0.5 kPa, with exact derivatives."""
        final_kpa = baseline_kpa + rise_kpa
        solved = solve_contact(baseline_kpa, final_kpa, self.balloon, self.circuit, self.law)
        if not math.isfinite(solved.force_n):
            return SolvedContact(solved, _UNKNOWN_DERIVATIVE, _UNKNOWN_DERIVATIVE)
        differentiator = self._differentiator(baseline_kpa, final_kpa, solved.indentation_mm)
        return SolvedContact(solved, differentiator.by(baseline_kpa=1.0), differentiator.by(final_kpa=1.0))

    def alarm_force_n(self, baseline_kpa: float, rise_kpa: float) -> float:  # noqa: ARG002
        """Return NaN. No other model has a solution where the equations of the paper have none."""
        return math.nan

    def largest_contact(self, baseline_kpa: float) -> LargestContact:
        """Return the contact that presses the balloon almost flat (`flat_balloon`)."""
        rise_kpa = largest_rise_kpa(baseline_kpa, self.balloon, self.circuit, self.law.sides)
        return LargestContact(rise_kpa, float(self.estimate(baseline_kpa, baseline_kpa + rise_kpa).force_n))

    def estimate(self, baseline_kpa: Number, final_kpa: Number) -> ContactEstimate:
        """Return the contact, interpolated to zero force below a rise of 0.5 kPa."""
        return estimate(baseline_kpa, final_kpa, self.balloon, self.circuit, self.law)

    def parameter_stds_n(
        self, baseline_kpa: float, rise_kpa: float, uncertainties: InputUncertainties
    ) -> dict[str, float]:
        """Return the standard uncertainty of the force [N] due to each uncertain parameter."""
        final_kpa = baseline_kpa + rise_kpa
        d = solve_contact(baseline_kpa, final_kpa, self.balloon, self.circuit, self.law).indentation_mm
        return parameter_stds_n(self._differentiator(baseline_kpa, final_kpa, d), uncertainties)

    def at_ambient(self, ambient_kpa: float) -> PublishedModel:
        """Return the same model at another ambient pressure P_0."""
        return replace(self, circuit=replace(self.circuit, ambient_kpa=ambient_kpa))

    def _differentiator(
        self, baseline_kpa: float, final_kpa: float, indentation_mm: float
    ) -> ContactDifferentiator:
        inputs = ModelInputs(baseline_kpa, final_kpa, self.balloon, self.circuit)
        return ContactDifferentiator(indentation_mm, inputs, self.law)
