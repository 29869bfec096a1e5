"""`pneuforce estimate` and `pneuforce budget`: one contact, from two pressures."""

from __future__ import annotations

import json
import math
from typing import NamedTuple

from instrument.errors import ConfigurationError
from instrument.model import Balloon, Circuit, Estimate, Law, estimate
from instrument.model.balloon import LOWEST_RISE_KPA, VALID_HIGH_KPA, VALID_LOW_KPA
from instrument.model.budget import Line, budget, total_n

MOST_KPA = 50.0  #: the sensor's full scale


class Contact(NamedTuple):
    """One contact, and why its force may not be trusted."""

    initial_kpa: float
    final_kpa: float
    law: Law
    solved: Estimate
    lines: tuple[Line, ...]  #: the uncertainty budget; empty without a force

    @property
    def std_n(self) -> float:
        """Standard uncertainty of the force [N], NaN without a force."""
        return total_n(self.lines) if self.lines else math.nan

    @property
    def in_range(self) -> bool:
        """Whether the paper validated this ΔP_i."""
        return VALID_LOW_KPA <= self.initial_kpa <= VALID_HIGH_KPA

    @property
    def reasons(self) -> list[str]:
        """What a user should know of this number."""
        reasons = []
        if not self.in_range:
            reasons.append(
                f"ΔP_i = {self.initial_kpa!r} kPa is outside the validated "
                f"{VALID_LOW_KPA}–{VALID_HIGH_KPA} kPa"
            )
        if not math.isfinite(self.solved.force_n):
            reasons.append("the model has no physical solution for these pressures")
        elif self.final_kpa - self.initial_kpa < LOWEST_RISE_KPA:
            reasons.append(f"rise below {LOWEST_RISE_KPA} kPa: interpolated to zero force at no rise")
        return reasons


def contact_of(initial_kpa: float, final_kpa: float, law: Law) -> Contact:
    """The contact between two pressures. Raises ConfigurationError where they make none."""
    _check(initial_kpa, final_kpa)
    balloon, circuit = Balloon(), Circuit()
    solved = estimate(initial_kpa, final_kpa, balloon, circuit, law)
    known = math.isfinite(solved.force_n)
    lines = budget(initial_kpa, final_kpa, balloon, circuit, law) if known else ()
    return Contact(initial_kpa, final_kpa, law, solved, lines)


def report(contact: Contact) -> str:
    """The contact as text."""
    solved, std_n = contact.solved, contact.std_n
    force = f"{solved.force_n:.3f} ± {std_n:.3f} N (standard uncertainty; pneuforce budget explains it)"
    lines = [f"force            {force if contact.lines else 'not available'}"]
    for name, value in (
        ("indentation d", solved.indentation_mm),
        ("contact radius a", solved.contact_radius_mm),
        ("radius R_i", solved.radius_mm),
        ("radius R_f", solved.radius_final_mm),
    ):
        lines.append(f"{name:<16} {f'{value:.3f} mm' if math.isfinite(value) else 'not available'}")
    lines.append(f"method           {contact.law.method}")
    return "\n".join(lines + [f"note: {reason}" for reason in contact.reasons])


def as_json(contact: Contact) -> str:
    """The contact as JSON; null for what does not exist."""
    return json.dumps(_answer(contact), indent=2, ensure_ascii=False)


def _answer(contact: Contact) -> dict[str, object]:
    solved = contact.solved
    return {
        "force_n": _known(solved.force_n),
        "force_std_n": _known(contact.std_n),
        "indentation_mm": _known(solved.indentation_mm),
        "contact_radius_mm": _known(solved.contact_radius_mm),
        "radius_mm": _known(solved.radius_mm),
        "radius_final_mm": _known(solved.radius_final_mm),
        "initial_kpa": contact.initial_kpa,
        "final_kpa": contact.final_kpa,
        "method": contact.law.method,
        "switch": contact.law.switch,
        "low": contact.law.low,
        "valid": contact.in_range and bool(contact.lines),
        "reasons": contact.reasons,
    }


def budget_report(contact: Contact) -> str:
    """The uncertainty budget as a table."""
    force_n = contact.solved.force_n
    if not contact.lines:
        return report(contact)
    rows = [f"{'input':<34} {'standard uncertainty':>22} {'makes of the force':>20}"]
    for line in contact.lines:
        rows.append(f"{line.what:<34} {f'{line.std:.4g} {line.unit}':>22} {line.force_n * 1e3:>17.1f} mN")
    share = 100 * contact.std_n / force_n if force_n else math.nan
    rows += [
        f"{'all, root of the sum of squares':<34} {f'{share:.1f} %':>22} {contact.std_n * 1e3:>17.1f} mN",
        f"force {force_n:.3f} N, ±2u = {2 * contact.std_n:.3f} N",
    ]
    return "\n".join(rows + [f"note: {reason}" for reason in contact.reasons])


def budget_json(contact: Contact) -> str:
    """The uncertainty budget as JSON."""
    lines = [line._asdict() for line in contact.lines]
    return json.dumps(_answer(contact) | {"budget": lines}, indent=2, ensure_ascii=False)


def _check(initial_kpa: float, final_kpa: float) -> None:
    if not (math.isfinite(initial_kpa) and math.isfinite(final_kpa)):
        raise ConfigurationError("--dpi and --dpf must be finite pressures in kPa")
    if not initial_kpa > 0:
        raise ConfigurationError(f"--dpi {initial_kpa:g}: the balloon must be inflated, ΔP_i above 0 kPa")
    if not final_kpa > initial_kpa:
        raise ConfigurationError(
            f"--dpf {final_kpa:g}: contact raises the pressure above --dpi {initial_kpa:g}"
        )
    if not final_kpa <= MOST_KPA:
        raise ConfigurationError(f"--dpf {final_kpa:g}: above the sensor's full scale of {MOST_KPA:g} kPa")


def _known(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
