"""Force model `membrane`: force from the table of a balloon, between a sliding and a sticking skin."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from pneuforce.instrument.model.balloon import Balloon, Circuit, Number
from pneuforce.instrument.model.derivatives import ContactDerivative
from pneuforce.instrument.model.force import ContactEstimate, solve_contact
from pneuforce.instrument.model.force_model import LargestContact, SolvedContact
from pneuforce.instrument.model.law import ForceLaw
from pneuforce.instrument.model.membrane.table import ROOTS, ForceTable, TableValues
from pneuforce.instrument.model.uncertainty import InputUncertainties

#: Smallest rise that is looked up [kPa]. Below it, the force follows a smooth curve to zero.
LOWEST_RISE_KPA = 0.04
#: Rise at the lower limit of the measuring range [kPa]. The noise is above 20 % of a smaller rise.
LOWER_RANGE_RISE_KPA = 0.1
#: Distance below a value of the table at which the highest force is looked up [√kPa]. The table ends at one
#: of its values, and rounding must not exceed this value.
_ROOT_BACKSTEP = 1e-6


class _GasVolume(NamedTuple):
    """Derivatives of the gas volume in the balloon during the contact [mm³ per unit of the input]."""

    by_tubes: Any
    by_ambient: Any
    by_polytropic: Any


@dataclass(frozen=True, slots=True)
class MembraneModel:
    """Force model of one balloon with its table."""

    balloon: Balloon
    circuit: Circuit
    law: ForceLaw
    table: ForceTable

    @property
    def is_consistent(self) -> bool:
        """Return True if the forces of the table grow with the rise and with the grip."""
        return self.table.is_consistent

    @property
    def lowest_rise_kpa(self) -> float:
        """Return the smallest rise that is looked up [kPa]."""
        return LOWEST_RISE_KPA

    @property
    def lower_range_rise_kpa(self) -> float:
        """Return the rise at the lower limit of the measuring range [kPa]."""
        return LOWER_RANGE_RISE_KPA

    def solve(self, baseline_kpa: float, rise_kpa: float) -> SolvedContact:
        """Return the contact at a rise of at least 0.04 kPa."""
        found = self.table.at(baseline_kpa, rise_kpa)
        contact = self._contact(found, baseline_kpa, rise_kpa)
        by_rise, by_baseline = (self._between(values) for values in (found.by_rise, found.by_baseline))
        return SolvedContact(
            ContactEstimate(*(float(value) for value in contact)),
            ContactDerivative(*(float(by_baseline[n] - by_rise[n]) for n in (0, 1))),
            ContactDerivative(float(by_rise[0]), float(by_rise[1])),
        )

    def alarm_force_n(self, baseline_kpa: float, rise_kpa: float) -> float:
        """Return a force [N] for alarms, for a contact that the table does not contain.

        It is the force of the energetic method, but at least the highest force of the table at this ΔP_i.
        """
        published = solve_contact(baseline_kpa, baseline_kpa + rise_kpa, self.balloon, self.circuit).force_n
        highest_n = self.largest_contact(baseline_kpa).force_n
        return float(np.nanmax([published, highest_n], initial=0.0)) if rise_kpa < math.inf else math.nan

    def largest_contact(self, baseline_kpa: float) -> LargestContact:
        """Return the contact with the highest force of the table at this ΔP_i; zeros if there is none."""
        rises_kpa = np.maximum(ROOTS - _ROOT_BACKSTEP, 0.0) ** 2
        forces_n = np.nan_to_num(self.estimate(baseline_kpa, baseline_kpa + rises_kpa).force_n)
        highest = int(np.argmax(forces_n))
        return LargestContact(float(rises_kpa[highest]), float(forces_n[highest]))

    def estimate(self, baseline_kpa: Number, final_kpa: Number) -> ContactEstimate:
        """Return the contact at any rise. Floats give floats; arrays are broadcast."""
        is_float = isinstance(baseline_kpa, float) and isinstance(final_kpa, float)
        baseline, final = np.broadcast_arrays(np.asarray(baseline_kpa, float), np.asarray(final_kpa, float))
        with np.errstate(all="ignore"):
            contact = self._contact(self.table.at(baseline, final - baseline), baseline, final - baseline)
        return ContactEstimate(*(float(value) for value in contact)) if is_float else contact

    def parameter_stds_n(
        self, baseline_kpa: float, rise_kpa: float, uncertainties: InputUncertainties
    ) -> dict[str, float]:
        """Return the standard uncertainty of the force [N] due to each uncertain parameter."""
        force_n, _, by_radius, by_volume = self.table.at(baseline_kpa, rise_kpa).value
        by_tubes = self._weighted(by_volume)
        gas = self._gas_volume(baseline_kpa, rise_kpa)
        derivatives = {
            "radius_mm": self._weighted(by_radius),
            "grip": force_n[1] - force_n[0],
            "volume_mm3": by_tubes,
            "ambient_kpa": by_tubes * gas.by_ambient / gas.by_tubes,
            "polytropic": by_tubes * gas.by_polytropic / gas.by_tubes,
        }
        return {
            name: abs(float(derivative)) * getattr(uncertainties, name)
            for name, derivative in derivatives.items()
        }

    def at_ambient(self, ambient_kpa: float) -> MembraneModel:
        """Return the same model at another ambient pressure P_0."""
        return replace(self, circuit=replace(self.circuit, ambient_kpa=ambient_kpa))

    def _contact(self, found: TableValues, baseline_kpa: Any, rise_kpa: Any) -> ContactEstimate:
        """Return the contact. The force is linear in the difference between P_0 and P_0 of the table."""
        force_n, indentation_mm, _, by_volume = self._between(found.value)
        gas = self._gas_volume(baseline_kpa, rise_kpa)
        by_ambient = by_volume * gas.by_ambient / gas.by_tubes
        force_n = force_n + by_ambient * (self.circuit.ambient_kpa - self.table.ambient_kpa)
        force_n = np.where(np.asarray(rise_kpa) > 0, force_n, np.where(np.isnan(rise_kpa), np.nan, 0.0))
        radius_mm = self.balloon.radius_mm(baseline_kpa) + 0.0 * force_n
        indentation_mm = np.where(np.asarray(rise_kpa) > 0, indentation_mm, 0.0 * force_n)
        a_squared = force_n * 1e3 / (math.pi * (baseline_kpa + np.maximum(rise_kpa, 0.0)))
        gap = radius_mm - indentation_mm
        return ContactEstimate(
            force_n, indentation_mm, a_squared**0.5, radius_mm, (a_squared + gap * gap) ** 0.5
        )

    def _between(self, values: Any) -> Any:
        """Return quantities (quantities, …) between those of the sliding and of the sticking skin."""
        return np.stack([self._weighted(quantity) for quantity in values])

    def _weighted(self, of_contacts: Any) -> Any:
        return (1 - self.law.grip) * of_contacts[0] + self.law.grip * of_contacts[1]

    def _gas_volume(self, baseline_kpa: Any, rise_kpa: Any) -> _GasVolume:
        """Return the derivatives of V_b = (V_c + V_i) q − V_c, q = ((P_0 + ΔP_i)/(P_0 + ΔP_f))^(1/n)."""
        ambient, n = self.table.ambient_kpa, self.circuit.polytropic
        radius = self.balloon.radius_mm(baseline_kpa)
        total = self.circuit.volume_mm3 + 4 / 3 * math.pi * radius**3
        before, after = ambient + baseline_kpa, ambient + baseline_kpa + np.maximum(rise_kpa, 1e-9)
        ratio = (before / after) ** (1 / n)
        by_ambient = total * ratio / n * (1 / before - 1 / after)
        return _GasVolume(ratio - 1, by_ambient, total * ratio * np.log(after / before) / (n * n))
