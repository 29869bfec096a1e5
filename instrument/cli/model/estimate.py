"""`pneuforce estimate` and `pneuforce uncertainty`: the force of one contact from two pressures."""

from __future__ import annotations

import math
from typing import NamedTuple

from pneuforce.errors import ConfigurationError, InvalidForce
from pneuforce.instrument.calibration.estimation import pressure_problem
from pneuforce.instrument.cli.terminal.failure import failure_values
from pneuforce.instrument.cli.terminal.output import done_values, json_line
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.model import ContactEstimate, ForceLaw
from pneuforce.instrument.model.balloon import VALID_HIGH_KPA, VALID_LOW_KPA
from pneuforce.instrument.model.curve import ContactCurve
from pneuforce.instrument.model.energies import ContactEnergies, contact_energies
from pneuforce.instrument.model.force import NO_FORCE
from pneuforce.instrument.model.force_model import LargestContact
from pneuforce.instrument.model.uncertainty_budget import (
    CONTACT_S,
    BudgetLine,
    combined_std_n,
    compute_budget,
)

REMEDY = "check both pressures"
NO_SOLUTION = "the model has no plausible solution for these pressures"


class EstimatedContact(NamedTuple):
    """One contact with its force, its uncertainty budget and its limitations."""

    baseline_kpa: float
    final_kpa: float
    law: ForceLaw
    lower_range_rise_kpa: float  #: rise at the lower limit of the measuring range
    solution: ContactEstimate
    energies: ContactEnergies
    budget: tuple[BudgetLine, ...]  #: the uncertainty budget; empty without a force
    largest: LargestContact  #: contact with the highest force at this ΔP_i; above its rise, there is no force

    @property
    def std_n(self) -> float:
        """Return the standard uncertainty of the force [N], NaN without a force."""
        return combined_std_n(self.budget) if self.budget else math.nan

    @property
    def in_range(self) -> bool:
        """Return True if ΔP_i is in the range that the paper validated."""
        return VALID_LOW_KPA <= self.baseline_kpa <= VALID_HIGH_KPA

    @property
    def may_be_flat(self) -> bool:
        """Return True if the balloon may be pressed flat."""
        return self.final_kpa - self.baseline_kpa > self.largest.rise_kpa

    @property
    def valid(self) -> bool:
        """Return True if there is a force with an uncertainty."""
        return bool(self.budget)

    @property
    def reasons(self) -> list[str]:
        """Return the reasons why there is no force, or why its validity is limited; empty if none."""
        reasons = []
        if not self.in_range:
            reasons.append(range_reason(self.baseline_kpa))
        elif self.may_be_flat:
            reasons.append(flat_reason(self.largest.rise_kpa))
        elif not self.valid:
            reasons.append(NO_SOLUTION)
        elif self.final_kpa - self.baseline_kpa < self.lower_range_rise_kpa:
            reasons.append(low_rise_reason(self.lower_range_rise_kpa))
        return reasons


def range_reason(baseline_kpa: float) -> str:
    """Return the reason why a ΔP_i outside the validated range gives no valid force."""
    return f"ΔP_i = {baseline_kpa!r} kPa is outside the validated {VALID_LOW_KPA}–{VALID_HIGH_KPA} kPa"


def flat_reason(largest_rise_kpa: float) -> str:
    """Return the reason why a large rise gives no valid force."""
    return f"the rise is above {largest_rise_kpa:.2f} kPa: the balloon may be pressed flat"


def low_rise_reason(lower_range_rise_kpa: float) -> str:
    """Return the reason why a force below the lower limit of the measuring range is no measurement."""
    return f"rise below {lower_range_rise_kpa} kPa: interpolated force, which shows a touch only"


def estimate_contact(
    baseline_kpa: float, final_kpa: float, settings: ChainSettings, contact_s: float = CONTACT_S
) -> EstimatedContact:
    """Return the contact between two gauge pressures. `contact_s` is the time since a sudden contact.

    ΔP_i outside the validated range and a balloon that may be pressed flat give no force, as in the
    instrument. A force without an uncertainty is no force either. Raises ConfigurationError for impossible
    pressures.
    """
    problem = pressure_problem(baseline_kpa, final_kpa, ("--dpi", "--dpf"))
    if problem:
        raise ConfigurationError(problem)
    model, correction = settings.force_model, settings.correction
    inputs, uncertainty = settings.input_uncertainties, settings.model_uncertainty
    curve = ContactCurve(baseline_kpa, model, correction, inputs)
    solution = model.estimate(baseline_kpa, final_kpa)
    if correction is not None:
        solution = curve.at(final_kpa - baseline_kpa).estimate
    contact = EstimatedContact(
        baseline_kpa,
        final_kpa,
        model.law,
        model.lower_range_rise_kpa,
        NO_FORCE._replace(radius_mm=solution.radius_mm),
        ContactEnergies(),
        (),
        LargestContact(curve.largest_rise_kpa, curve.force_n(curve.largest_rise_kpa)),
    )
    if contact.may_be_flat or not (contact.in_range and math.isfinite(solution.force_n)):
        return contact
    budget = compute_budget(baseline_kpa, final_kpa, model, correction, inputs, uncertainty, contact_s)
    if not math.isfinite(combined_std_n(budget)):
        return contact
    energies = contact_energies(baseline_kpa, final_kpa, settings.balloon, settings.circuit, model.law)
    return contact._replace(solution=solution, energies=energies, budget=budget)


def format_estimate(contact: EstimatedContact) -> str:
    """Return the contact as text."""
    solution, std_n = contact.solution, contact.std_n
    force = (
        f"{solution.force_n:.3f} ± {std_n:.3f} N (standard uncertainty; pneuforce uncertainty explains it)"
    )
    lines = [f"force            {force if contact.valid else 'no valid force'}"]
    for name, value in (
        ("indentation d", solution.indentation_mm),
        ("contact radius a", solution.contact_radius_mm),
        ("radius R_i", solution.radius_mm),
        ("radius R_f", solution.radius_final_mm),
    ):
        lines.append(f"{name:<16} {f'{value:.3f} mm' if math.isfinite(value) else 'not available'}")
    lines.append(f"method           {_method_text(contact.law)}")
    if contact.law.method == "membrane":
        lines.append(f"grip             {contact.law.grip:.2f} (0: the skin slides, 1: it sticks)")
    lines += _largest_force(contact)
    return "\n".join(lines + [f"note: {reason}" for reason in contact.reasons])


def _method_text(law: ForceLaw) -> str:
    """Return the method with its variants. The instrument has another `switch` than the paper."""
    if law.method == "membrane":
        return law.method
    variants = [f"switch {law.switch}"] if law.method == "energetic" else []
    return ", ".join([law.method, *variants, f"low {law.low}"])


def _largest_force(contact: EstimatedContact) -> list[str]:
    """Return a line with the highest force at this ΔP_i; no line outside the validated range."""
    if not contact.in_range:
        return []
    rise_kpa, force_n = contact.largest
    return [f"highest force    {force_n:.2f} N at this ΔP_i, at a rise of {rise_kpa:.2f} kPa"]


def estimate_json(contact: EstimatedContact) -> str:
    """Return the contact as JSON, with null for values that do not exist."""
    return json_line(_envelope(contact) | _facts(contact))


def _facts(contact: EstimatedContact) -> dict[str, object]:
    solution = contact.solution
    return {
        "force_n": finite_or_none(solution.force_n),
        "force_std_n": finite_or_none(contact.std_n),
        "indentation_mm": finite_or_none(solution.indentation_mm),
        "contact_radius_mm": finite_or_none(solution.contact_radius_mm),
        "radius_mm": finite_or_none(solution.radius_mm),
        "radius_final_mm": finite_or_none(solution.radius_final_mm),
        "baseline_kpa": contact.baseline_kpa,
        "final_kpa": contact.final_kpa,
        "method": contact.law.method,
        "highest_force_n": finite_or_none(contact.largest.force_n) if contact.in_range else None,
        **_method_facts(contact),
        "valid": contact.valid,
        "reasons": contact.reasons,
    }


def _method_facts(contact: EstimatedContact) -> dict[str, object]:
    """Return the choices and the results that only the method of this contact has."""
    law = contact.law
    if law.method == "membrane":
        return {
            "grip": law.grip,
            "pressed_sides": law.sides,
        }
    if law.method != "energetic":
        return {"low": law.low}
    energies = contact.energies._asdict().items()
    return {
        "switch": law.switch,
        "low": law.low,
        **{name: finite_or_none(value) for name, value in energies},
    }


def format_budget(contact: EstimatedContact) -> str:
    """Return the uncertainty budget as a table."""
    force_n = contact.solution.force_n
    if not contact.valid:
        return format_estimate(contact)
    rows = [f"{'input':<34} {'standard uncertainty':>22} {'part of the force':>20}"]
    for line in contact.budget:
        rows.append(f"{line.source:<34} {f'{line.std:.4g} {line.unit}':>22} {line.force_n * 1e3:>17.1f} mN")
    percent = 100 * contact.std_n / force_n if force_n else math.nan
    rows += [
        f"{'all, root of the sum of squares':<34} {f'{percent:.1f} %':>22} {contact.std_n * 1e3:>17.1f} mN",
        f"force {force_n:.3f} N, ±2u = {2 * contact.std_n:.3f} N",
    ]
    rows += _largest_force(contact)
    return "\n".join(rows + [f"note: {reason}" for reason in contact.reasons])


def budget_json(contact: EstimatedContact) -> str:
    """Return the contact with its uncertainty budget as JSON."""
    lines = [line._asdict() for line in contact.budget]
    return json_line(_envelope(contact) | _facts(contact) | {"budget": lines})


def _envelope(contact: EstimatedContact) -> dict[str, object]:
    """Return the keys that all results have: without a valid force, those of a failure."""
    if contact.valid:
        return done_values(f"force {contact.solution.force_n:.3f} N")
    return failure_values(InvalidForce(("out_of_range",), problem(contact)))


def problem(contact: EstimatedContact) -> str:
    """Return why there is no force, and the remedy; "" if there is a force."""
    return "" if contact.valid else f"{'; '.join(contact.reasons)}: {REMEDY}"


def finite_or_none(value: float) -> float | None:
    """Return the value, or None for JSON if it is NaN or infinite."""
    return float(value) if math.isfinite(value) else None
