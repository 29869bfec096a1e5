"""Interface of a force model: the contact that follows from two pressures, with its sensitivities."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple, Protocol

from pneuforce.instrument.model.balloon import Balloon, Circuit, Number
from pneuforce.instrument.model.derivatives import ContactDerivative
from pneuforce.instrument.model.force import ContactEstimate
from pneuforce.instrument.model.law import ForceLaw
from pneuforce.instrument.model.uncertainty import InputUncertainties


class SolvedContact(NamedTuple):
    """Contact at one ΔP_i and rise, with its derivatives. The values are NaN if there is no solution."""

    estimate: ContactEstimate
    by_baseline: ContactDerivative  #: derivative with respect to ΔP_i at a constant ΔP_f
    by_final: ContactDerivative  #: derivative with respect to ΔP_f at a constant ΔP_i


class LargestContact(NamedTuple):
    """Contact with the highest force that a balloon can measure at one ΔP_i: it is then almost flat."""

    rise_kpa: float
    force_n: float


class ForceModel(Protocol):
    """Force model of one balloon and its circuit."""

    @property
    def balloon(self) -> Balloon:
        """Return the balloon."""
        ...

    @property
    def circuit(self) -> Circuit:
        """Return the gas circuit."""
        ...

    @property
    def law(self) -> ForceLaw:
        """Return the chosen force law."""
        ...

    @property
    def is_consistent(self) -> bool:
        """Return True if the data of the model, which do not change while it runs, are consistent."""
        ...

    @property
    def lowest_rise_kpa(self) -> float:
        """Return the smallest rise [kPa] for `solve`. Below it, the force is interpolated to zero."""
        ...

    @property
    def lower_range_rise_kpa(self) -> float:
        """Return the rise [kPa] at the lower limit of the measuring range."""
        ...

    def solve(self, baseline_kpa: float, rise_kpa: float) -> SolvedContact:
        """Return the contact at a rise of at least `lowest_rise_kpa`."""
        ...

    def alarm_force_n(self, baseline_kpa: float, rise_kpa: float) -> float:
        """Return a force [N] for alarms, for a contact without a solution. NaN if no force is known."""
        ...

    def largest_contact(self, baseline_kpa: float) -> LargestContact:
        """Return the contact with the highest force that the balloon can measure at this ΔP_i."""
        ...

    def estimate(self, baseline_kpa: Number, final_kpa: Number) -> ContactEstimate:
        """Return the contact at any rise. Floats give floats; arrays are broadcast."""
        ...

    def parameter_stds_n(
        self, baseline_kpa: float, rise_kpa: float, uncertainties: InputUncertainties
    ) -> Mapping[str, float]:
        """Return the standard uncertainty of the force [N] due to each uncertain parameter.

        The keys are names of fields of `InputUncertainties`. The rise is at least `lowest_rise_kpa`.
        """
        ...

    def at_ambient(self, ambient_kpa: float) -> ForceModel:
        """Return the same model at another ambient pressure P_0."""
        ...
