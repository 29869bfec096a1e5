"""The uncertainty budget of one contact, line by line."""

from __future__ import annotations

import math
from typing import NamedTuple

from instrument.model.balloon import LOWEST_RISE_KPA, Balloon, Circuit
from instrument.model.correction import Correction
from instrument.model.curve import ContactCurve
from instrument.model.derivatives import Derivatives, Inputs
from instrument.model.force import contact
from instrument.model.law import PAPER, Law
from instrument.model.uncertainty import (
    InputErrors,
    ModelErrors,
    contributions_n,
    parameter_spreads_n,
)

#: How long a contact hides its baseline where nobody says [s].
CONTACT_S = 5.0
UNITS = {
    "radius_mm": ("radius R_i", "mm"),
    "young_kpa": ("Young's modulus E", "kPa"),
    "rest_thickness_mm": ("thickness h_0", "mm"),
    "poisson": ("Poisson's ratio ν", ""),
    "volume_mm3": ("volume of the pipes V_c", "mm³"),
    "ambient_kpa": ("ambient pressure P_0", "kPa"),
    "polytropic": ("gas exponent n, 1 to 1.2", ""),
}


class Line(NamedTuple):
    """One input of the budget."""

    what: str
    std: float  #: its standard uncertainty
    unit: str
    force_n: float  #: what that makes of the force, as a standard deviation [N]


def budget(
    initial_kpa: float,
    final_kpa: float,
    balloon: Balloon,
    circuit: Circuit,
    law: Law = PAPER,
    correction: Correction | None = None,
    errors: InputErrors | None = None,
    model: ModelErrors | None = None,
    contact_s: float = CONTACT_S,
) -> tuple[Line, ...]:
    """Every input's part in the uncertainty of a force, `contact_s` after the contact began."""
    errors, model = errors or InputErrors(), model or ModelErrors.of(law.method)
    rise_kpa, drift_kpa = final_kpa - initial_kpa, errors.drift_kpa_per_s * contact_s
    curve = ContactCurve(initial_kpa, balloon, circuit, law, correction, errors)
    point = curve.at(rise_kpa)
    known = errors.at_rest(initial_kpa, final_kpa, 0.0)
    force_n, spread = point.estimate.force_n, point.spread
    by_initial, by_final, by_gain, _, by_law, by_join = contributions_n(
        force_n, spread, known, errors, model, balloon
    )
    by_drift = spread.initial_n_per_kpa * drift_kpa
    share = model.share(initial_kpa, balloon)
    return (
        Line("noise of ΔP_i", errors.initial_noise_kpa, "kPa", abs(by_initial)),
        Line("noise of ΔP_f", errors.final_noise_kpa, "kPa", abs(by_final)),
        Line("sensor's gain after its zero", 100 * errors.gain, "%", abs(by_gain)),
        Line(f"drift of ΔP_i in {contact_s:g} s", drift_kpa, "kPa", abs(by_drift)),
        *_parameters(initial_kpa, rise_kpa, spread.parameters_n, balloon, circuit, law, errors),
        Line("the law itself", 100 * share, "% of the force", by_law),
        Line("its join to zero", abs(spread.join_n) / math.sqrt(3), "N", abs(by_join)),
    )


def _parameters(
    initial_kpa: float,
    rise_kpa: float,
    all_n: float,
    balloon: Balloon,
    circuit: Circuit,
    law: Law,
    errors: InputErrors,
) -> list[Line]:
    """One line for each parameter. On the join to zero all keep the proportion that they have at its end."""
    solved_kpa = initial_kpa + max(rise_kpa, LOWEST_RISE_KPA)
    d = contact(initial_kpa, solved_kpa, balloon, circuit, law).indentation_mm
    derivatives = Derivatives(d, Inputs(initial_kpa, solved_kpa, balloon, circuit), law)
    spreads_n = parameter_spreads_n(derivatives, errors)
    scale = all_n / math.hypot(*spreads_n.values())
    return [
        Line(UNITS[name][0], getattr(errors, name), UNITS[name][1], force_n * scale)
        for name, force_n in spreads_n.items()
    ]


def total_n(lines: tuple[Line, ...]) -> float:
    """Standard uncertainty of the force [N]."""
    return math.hypot(*(line.force_n for line in lines))
