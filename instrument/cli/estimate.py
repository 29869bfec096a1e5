"""`pneuforce estimate`: one contact, from two pressures."""

from __future__ import annotations

import json
import math

from instrument.errors import ConfigurationError
from instrument.model import Balloon, Circuit, estimate
from instrument.model.balloon import LOWEST_RISE_KPA, VALID_HIGH_KPA, VALID_LOW_KPA
from instrument.model.uncertainty import InputErrors, LowEnd, sensitivities

MOST_KPA = 50.0  #: the sensor's full scale


def report(initial_kpa: float, final_kpa: float, method: str, as_json: bool) -> str:
    """The estimate as text or JSON. Raises ConfigurationError where the pressures make no contact."""
    _check(initial_kpa, final_kpa)
    answer = answer_of(initial_kpa, final_kpa, method)
    if as_json:
        return json.dumps(answer, indent=2, ensure_ascii=False)
    force = "not available" if answer["force_n"] is None else f"{answer['force_n']:.3f} N"
    if answer["force_std_n"] is not None:
        force += f" ± {answer['force_std_n']:.3f} N (standard uncertainty of the inputs)"
    lines = [f"force            {force}"]
    for name, key in (
        ("indentation d", "indentation_mm"),
        ("contact radius a", "contact_radius_mm"),
        ("radius R_i", "radius_mm"),
        ("radius R_f", "radius_final_mm"),
    ):
        value = answer[key]
        lines.append(f"{name:<16} {'not available' if value is None else f'{value:.3f} mm'}")
    lines.append(f"method           {method}")
    return "\n".join(lines + [f"note: {reason}" for reason in answer["reasons"]])  # type: ignore[attr-defined]


def answer_of(initial_kpa: float, final_kpa: float, method: str) -> dict[str, object]:
    """Everything known of one contact, by the names of the JSON answer; None for what does not exist."""
    balloon, circuit, errors = Balloon(), Circuit(), InputErrors()
    solved = estimate(initial_kpa, final_kpa, balloon, circuit, method)
    rise_kpa, std_n = final_kpa - initial_kpa, math.nan
    if math.isfinite(solved.force_n):
        by_input = (
            LowEnd.of(initial_kpa, balloon, circuit, method).at(rise_kpa)
            if rise_kpa < LOWEST_RISE_KPA
            else sensitivities(initial_kpa, final_kpa, solved.indentation_mm, balloon, circuit, method)
        )
        std_n = by_input.std_n(initial_kpa, final_kpa, errors)
    in_range = VALID_LOW_KPA <= initial_kpa <= VALID_HIGH_KPA
    reasons = []
    if not in_range:
        reasons.append(
            f"ΔP_i = {initial_kpa!r} kPa is outside the validated {VALID_LOW_KPA}–{VALID_HIGH_KPA} kPa"
        )
    if not math.isfinite(solved.force_n):
        reasons.append("the model has no physical solution for these pressures")
    elif rise_kpa < LOWEST_RISE_KPA:
        reasons.append(f"rise below {LOWEST_RISE_KPA} kPa: interpolated to zero force at no rise")
    return {
        "force_n": _known(solved.force_n),
        "force_std_n": _known(std_n),
        "indentation_mm": _known(solved.indentation_mm),
        "contact_radius_mm": _known(solved.contact_radius_mm),
        "radius_mm": _known(solved.radius_mm),
        "radius_final_mm": _known(solved.radius_final_mm),
        "initial_kpa": initial_kpa,
        "final_kpa": final_kpa,
        "method": method,
        "valid": in_range and math.isfinite(solved.force_n),
        "reasons": reasons,
    }


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
