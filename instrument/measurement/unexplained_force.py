"""Uncertainty of the force due to rises of the pressure that are not explained, and to cold gas.

`unexplained_rise.py` adds up the rises that are either drift or a slow press. `gas_heat.py` computes how far
cold gas can have lowered the pressure.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from pneuforce.instrument.measurement.contact import CONFIRMED_KPA, ONSET_KPA
from pneuforce.instrument.model.curve import ContactCurve
from pneuforce.instrument.model.uncertainty import ModelUncertainty, force_std_n

#: The unexplained rise is rounded up to this step, so that the uncertainty is seldom computed again.
STEP_KPA = 0.001


@dataclass(slots=True)
class HiddenPress:
    """Uncertainty of a force of 0 N, because a slow press can have caused the unexplained rise."""

    _curve: ContactCurve | None = None  # force curve and rise of the cached result
    _steps: int = 0
    _std_n: float = 0.0

    def std_n(self, curve: ContactCurve, hidden_kpa: float, model: ModelUncertainty) -> float:
        """Return the standard uncertainty [N]. Twice this value is the highest force of a hidden press.

        `model` is the uncertainty of the force law. A new `model` needs a new curve.
        """
        if hidden_kpa <= CONFIRMED_KPA:
            return 0.0
        steps = math.ceil(hidden_kpa / STEP_KPA)
        if self._curve is not curve or self._steps != steps:
            self._curve, self._steps, self._std_n = curve, steps, _compute_n(curve, steps * STEP_KPA, model)
        return self._std_n


def _compute_n(curve: ContactCurve, hidden_kpa: float, model: ModelUncertainty) -> float:
    point, baseline_kpa, inputs = curve.at(hidden_kpa), curve.baseline_kpa, curve.uncertainties
    pressures = inputs.at_rest(baseline_kpa, baseline_kpa + hidden_kpa, 0.0)
    law_std_n = force_std_n(point.estimate.force_n, point.sensitivity, pressures, inputs, model)
    share = min(hidden_kpa / ONSET_KPA, 1.0)
    return math.hypot(curve.force_n(hidden_kpa + ONSET_KPA) / 2, share * law_std_n)


def unexplained_std_n(curve: ContactCurve, rise_kpa: float, hidden_kpa: float, during_kpa: float) -> float:
    """Return the standard uncertainty [N] of the force of a contact due to rises that are not explained.

    The true rise is higher by at most `hidden_kpa` (`ContactTracker`), or lower by `during_kpa`
    (`UnexplainedRise`). The true force lies between the forces at the smallest and at the largest possible
    rise. Both of them are within twice the returned value. A remaining rise below the detection limit counts
    as no force.
    """
    force_n = curve.force_n(rise_kpa)
    drifted_kpa = during_kpa + min(during_kpa, ONSET_KPA)
    least_n = curve.force_n(rise_kpa - drifted_kpa) if drifted_kpa else force_n
    most_n = curve.force_n(rise_kpa + hidden_kpa) if hidden_kpa else force_n
    return max(force_n - least_n, most_n - force_n) / 2
