"""Tests of a force calibration outside its contacts: the uncertainty is not smaller than before."""

from dataclasses import replace
from datetime import date
from functools import cache
from pathlib import Path

import pytest

from pneuforce.instrument.calibration import file
from pneuforce.instrument.calibration.apply import apply_calibration, force_conditions
from pneuforce.instrument.calibration.contacts import parse_contacts, read_contacts
from pneuforce.instrument.calibration.force import fit_force
from pneuforce.instrument.calibration.parts import force_part
from pneuforce.instrument.calibration.plausibility import warnings_about
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.model import ForceLaw
from pneuforce.instrument.model.pressure_bins import pressure_bin_indices
from pneuforce.instrument.model.uncertainty_budget import combined_std_n, compute_budget
from tests.instrument.calibration.test_golden import GOLDEN

EXAMPLE = Path(__file__).parents[3] / "docs/examples/reference-contacts.csv"
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


@cache
def example_calibration(added=""):
    """Return the contacts of the example, and the settings that are calibrated with them."""
    return calibrated_with(EXAMPLE.read_bytes() + added.encode())


def calibrated_with(content):
    """Return the contacts of a table, and the settings that are calibrated with them."""
    points = parse_contacts(content, "contacts.csv")
    before = ChainSettings()
    found = fit_force(read_contacts(points, before), before)
    part = force_part(found, [], points, before, date(2026, 1, 1))
    return found.contacts, apply_calibration(before, file.empty(0).model_copy(update={"force": part}))


def contacts_at(setpoint_kpa):
    """Return a table of contacts within 0.03 kPa of a setpoint, on a balloon with 0.8 of the force."""
    lines = ["baseline_kpa,final_kpa,force_n,force_std_n"]
    for number in range(12):
        baseline_kpa = setpoint_kpa + 0.03 * (number % 3 - 1)
        final_kpa = baseline_kpa + 0.4 * 1.2**number
        law_n = ChainSettings().force_model.estimate(baseline_kpa, final_kpa).force_n
        force_n = 0.8 * law_n * (1 + 0.01 * (-1) ** number)
        lines.append(f"{baseline_kpa:.5f},{final_kpa:.5f},{force_n:.5f},0.01")
    return "\n".join(lines).encode()


def test_above_the_forces_of_its_contacts_the_uncertainty_is_that_before_the_calibration():
    """At 11 kPa the rise is that of 5 N, and the largest contact there has 3.2 N.

    At 7.6 kPa, a contact has a larger rise.
    """
    _, after = example_calibration()
    assert std_n(after, 11.0, 3.84873) >= std_n(ChainSettings(), 11.0, 3.84873)
    assert std_n(after, 11.0, 2.0) < 0.5 * std_n(ChainSettings(), 11.0, 2.0)
    assert std_n(after, 7.6, 3.84873) < 0.7 * std_n(ChainSettings(), 7.6, 3.84873)


def test_contacts_at_one_setpoint_calibrate_the_force_near_this_setpoint_only():
    before, (_, after) = ChainSettings(), calibrated_with(contacts_at(8.0))
    assert all(std_n(after, kpa, 2.0) < 0.2 * std_n(before, kpa, 2.0) for kpa in (7.9, 8.0, 8.1))
    elsewhere_kpa = (5.5, 7.6, 7.8, 8.2, 8.8, 11.0)  # the force and its uncertainty are 0.8 of those before
    assert all(std_n(after, kpa, 2.0) >= 0.79 * std_n(before, kpa, 2.0) for kpa in elsewhere_kpa)
    (warning,) = warnings_about(file.empty(0), after, date(2026, 1, 1))
    assert "of 4.95–6.25, 6.25–7.55, 7.55–8.85 (but 7.87–8.13), 8.85–10.15, 10.15–11.45 kPa" in warning


@pytest.mark.parametrize("added", ["", "9.30001,12.4567891234567,2.9,0.01\n"])
def test_the_largest_and_the_smallest_contact_of_each_bin_are_inside_the_calibrated_span(added):
    """The file rounds its limits outwards."""
    contacts, after = example_calibration(added)
    bins = pressure_bin_indices(contacts.baseline_kpa)
    for index in range(5):
        in_bin = contacts.select(bins == index)
        for row, step in ((in_bin.rise_kpa.argmax(), 1.021), (in_bin.rise_kpa.argmin(), 0.979)):
            baseline_kpa, rise_kpa = float(in_bin.baseline_kpa[row]), float(in_bin.rise_kpa[row])
            assert after.correction.covers(rise_kpa, baseline_kpa)
            inside_n = after.model_uncertainty.std_n(1.0, baseline_kpa, rise_kpa)
            assert after.model_uncertainty.std_n(1.0, baseline_kpa, rise_kpa * step) > inside_n
