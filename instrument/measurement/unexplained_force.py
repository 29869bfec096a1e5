"""Uncertainty of the force due to the unexplained rise of the pressure (`unexplained_rise.py`)."""

from __future__ import annotations

import math

from pneuforce.instrument.measurement.contact import ONSET_KPA
from pneuforce.instrument.measurement.unexplained_rise import UnexplainedRise
from pneuforce.instrument.model.curve import ContactCurve


def hidden_press_std_n(curve: ContactCurve, hidden_kpa: float, law_std_n: float) -> float:
    """Return the standard uncertainty [N] of a force of 0 N, if a slow press can have caused `hidden_kpa`.

    Twice the returned value is the highest force of a press that is not detected. `law_std_n` is the standard
    uncertainty of the force law at this rise.
    """
    share = min(hidden_kpa / ONSET_KPA, 1.0)
    return math.hypot(curve.force_n(hidden_kpa + ONSET_KPA) / 2, share * law_std_n)


def unexplained_std_n(curve: ContactCurve, rise_kpa: float, unexplained: UnexplainedRise) -> float:
    """Return the standard uncertainty [N] of the force of a contact due to the unexplained rise.

    The true force lies between the forces at the smallest and at the largest possible rise. Both of them are
    within twice the returned value. A remaining rise below the detection limit counts as no force.
    """
    force_n = curve.force_n(rise_kpa)
    drifted_kpa = unexplained.during_kpa + min(unexplained.during_kpa, ONSET_KPA)
    least_n = curve.force_n(rise_kpa - drifted_kpa)
    most_n = curve.force_n(rise_kpa + unexplained.before_kpa)
    return max(force_n - least_n, most_n - force_n) / 2
