"""Tests of a force calibration outside its contacts: the uncertainty is not smaller than before."""

from dataclasses import replace

import pytest

from pneuforce.instrument.calibration import file
from pneuforce.instrument.calibration.apply import apply_calibration, force_conditions
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.model import ForceLaw
from pneuforce.instrument.model.uncertainty_budget import combined_std_n, compute_budget
from tests.instrument.calibration.test_golden import GOLDEN

COVERED, LOW, HIGH = (0.8, 1.0, 1.2), (0.1, 0.3, 0.58), (1.55, 2.0, 4.0)


def std_n(settings, baseline_kpa, rise_kpa):
    uncertainties = settings.input_uncertainties, settings.model_uncertainty
    model, correction = settings.force_model, settings.correction
    return combined_std_n(
        compute_budget(baseline_kpa, baseline_kpa + rise_kpa, model, correction, *uncertainties)
    )


def calibrated(before):
    """Return the settings after a force calibration at rises of 0.6 to 1.5 kPa that changes no force."""
    part = file.load(GOLDEN).force
    terms = ("constant", "by_rise", "by_initial_per_kpa", "by_both_per_kpa", "by_step")
    spans = {"rise_low_kpa": 0.6, "rise_high_kpa": 1.5, "initial_low_kpa": 5.0, "initial_high_kpa": 8.8}
    changes = dict.fromkeys(terms, 0.0) | spans | {"made_for": force_conditions(before)}
    return apply_calibration(
        before, file.empty(0).model_copy(update={"force": part.model_copy(update=changes)})
    )


@pytest.mark.parametrize("law", [ForceLaw(method=method) for method in ("energetic", "lulevich", "shanahan")])
def test_outside_the_contacts_the_uncertainty_is_not_smaller_than_before(law):
    before = ChainSettings.of(law)
    after = calibrated(before)
    points = [(kpa, rise) for kpa in (5.5, 8.0) for rise in (*LOW, *HIGH)]
    points += [(kpa, rise) for kpa in (9.5, 11.0) for rise in (*LOW, *COVERED, *HIGH)]
    assert all(std_n(after, *point) >= std_n(before, *point) for point in points)
    assert all(std_n(after, 8.0, rise) < 0.5 * std_n(before, 8.0, rise) for rise in COVERED)


def test_outside_the_contacts_the_errors_of_the_inputs_count_again():
    """The method membrane has a small uncertainty of its law, and a large one of its inputs."""
    before = ChainSettings()
    exact = replace(before, model_uncertainty=type(before.model_uncertainty).constant(0.0))
    after = calibrated(exact)
    assert all(std_n(after, kpa, 3.0) >= std_n(exact, kpa, 3.0) for kpa in (5.5, 11.0))
    assert std_n(after, 11.0, 1.0) >= std_n(exact, 11.0, 1.0)
