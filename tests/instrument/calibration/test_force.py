"""Tests of the force calibration: it finds known corrections and rejects useless corrections."""

from dataclasses import replace

import numpy as np
import pytest

from pneuforce.instrument.calibration.contacts import CalibrationContacts, parse_contacts, read_contacts
from pneuforce.instrument.calibration.force import fit_force
from pneuforce.instrument.calibration.residuals import contact_residuals, errors_by_pressure, share_and_floor
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.model import Balloon, ForceCorrection, estimate
from pneuforce.instrument.model.pressure_bins import BIN_EDGES_KPA, pressure_bin_indices
from pneuforce.instrument.recording.contact_table import CONTACT_TYPES
from tests.instrument.calibration.points import error_message, points, share_within

SETTINGS = ChainSettings()
TERMS = ("constant", "by_rise", "by_initial", "by_both", "by_step")
TRUTH = {"constant": -0.2, "by_rise": 0.3, "by_initial": -0.05, "by_both": 0.05}
WIDE = {"rise_span_kpa": (0.01, 20.0), "baseline_span_kpa": (2.0, 12.0)}


def simulated_contacts(seed, count=24, noise=0.02, reference_n=0.0, settings=SETTINGS, **terms):
    """Return contacts and their exact forces: the forces by the force law, times a known correction.

    `noise` is the relative noise of the measured force. `reference_n` is the noise of the force sensor [N].
    """
    generator = np.random.default_rng(seed)
    baseline = generator.uniform(5, 11.4, count)
    rise = np.exp(generator.uniform(np.log(0.3), np.log(4), count))
    law, balloon = settings.law, settings.balloon
    law_n = estimate(baseline, baseline + rise, balloon, settings.circuit, law).force_n
    correction = ForceCorrection(**dict.fromkeys(TERMS, 0.0) | terms, **WIDE, law=law)
    truth_n = law_n * correction.factor(rise, baseline)
    force_n = truth_n * np.exp(generator.normal(0, noise, count)) + generator.normal(0, reference_n, count)
    weight = law.small_strain_weight(baseline, balloon)
    std_n = np.full(count, reference_n)
    return CalibrationContacts(baseline, rise, force_n, std_n, law_n, weight), truth_n


def test_the_true_coefficients_lie_within_their_stated_uncertainty():
    fits = [fit_force(simulated_contacts(n, **TRUTH)[0], SETTINGS) for n in range(60)]
    correct = [fit for fit in fits if fit.chosen.terms == TERMS[:4]]
    assert len(correct) >= 40
    for k, term in enumerate(TERMS[:4]):
        errors = [fit.fit.coefficients[k] - TRUTH[term] for fit in correct]
        assert 0.5 <= share_within(errors, [fit.fit.stds[k] for fit in correct]) <= 0.86


def test_each_contact_has_its_residual_with_its_line_and_an_outlier_is_the_largest():
    contacts, _ = simulated_contacts(1, **TRUTH)
    contacts.force_n[7] *= 1.4
    found = fit_force(contacts, SETTINGS)
    rows = contact_residuals(found.chosen.held_out_n, contacts, range(2, 26))
    assert max(rows, key=lambda row: row.ratio).line == 9
    assert [row.reference_n + row.difference_n for row in rows] == pytest.approx(found.chosen.held_out_n)


def test_the_residual_is_the_typical_error_on_new_contacts():
    within = []
    for seed in range(30):
        calibration = fit_force(simulated_contacts(seed, noise=0.04, **TRUTH)[0], SETTINGS)
        share, floor_n = share_and_floor(calibration.chosen.held_out_n, calibration.contacts)
        new, _ = simulated_contacts(1000 + seed, count=50, noise=0.04, **TRUTH)
        force_n = new.law_n * calibration.correction.factor(new.rise_kpa, new.baseline_kpa)
        within.append(share_within(force_n - new.force_n, np.hypot(share * force_n, floor_n)))
    assert 0.58 <= np.mean(within) <= 0.8


@pytest.mark.parametrize("terms", [1, 2, 3])
def test_no_more_terms_are_chosen_than_the_true_correction_has(terms):
    truth = dict(list(TRUTH.items())[:terms])
    chosen = [len(fit_force(simulated_contacts(n, **truth)[0], SETTINGS).chosen.terms) for n in range(20)]
    assert chosen.count(terms) >= 12
    assert min(chosen) >= terms - 1


def test_few_contacts_support_few_terms():
    for count in (6, 8, 9, 11, 12, 14):
        calibration = fit_force(simulated_contacts(1, count, **TRUTH)[0], SETTINGS)
        assert max(len(c.terms) for c in calibration.candidates) <= count // 3


def test_a_correction_that_is_no_better_than_the_law_is_rejected():
    message = error_message(fit_force, simulated_contacts(3, noise=0.08)[0], SETTINGS)
    assert message.startswith("no calibration: ")
    assert "nothing was written" in message


def test_contacts_at_one_setpoint_give_no_slope_over_setpoints():
    contacts, _ = simulated_contacts(1, **TRUTH)
    same = replace(contacts, baseline_kpa=np.full(24, 8.0))
    candidates = fit_force(same, SETTINGS).candidates
    assert all(not {"by_initial", "by_both"} & set(c.terms) for c in candidates)


def test_a_correction_that_falls_while_the_pressure_rises_is_rejected():
    contacts, _ = simulated_contacts(1, noise=0.001, by_rise=-0.9, constant=0.3)
    assert "would fall as the pressure rises" in error_message(fit_force, contacts, SETTINGS)


def test_contacts_with_a_large_reference_uncertainty_have_a_small_weight():
    contacts, _ = simulated_contacts(5, noise=0.001, constant=0.2)
    wrong_n = contacts.force_n * np.where(contacts.force_n < 1.2, 1.5, 1.0)
    std_n = np.where(contacts.force_n < 1.2, 0.5 * contacts.force_n, 0.001)
    calibration = fit_force(replace(contacts, force_n=wrong_n, std_n=std_n), SETTINGS)
    large = contacts.select(contacts.force_n > 1.5)
    factor = calibration.correction.factor(large.rise_kpa, large.baseline_kpa)
    assert factor == pytest.approx(np.full(len(large), np.exp(0.2)), rel=0.03)


VALID = {"baseline_kpa": [8.0] * 6, "final_kpa": [9.0] * 6, "force_n": [1.0] * 6}


@pytest.mark.parametrize(
    ("changed", "expected"),
    [
        ({"baseline_kpa": [8, 8, 4.9, 8, 8, 8]}, "line 4: baseline_kpa is outside 4.95 to 11.45 kPa"),
        ({"final_kpa": [9, 8.01, 9, 9, 9, 9]}, "line 3: final_kpa is not 0.06 kPa above"),
        ({"force_n": [1, 1, 1, 1, 1, 0]}, "line 7: force_n must be above 0"),
        ({"force_n": [1, 1, 1, 1, 1, -1]}, "line 7: force_n"),
        ({"force_n": [1, 1, 21, 1, 1, 1]}, "line 4: force_n must be above 0 and at most 20 N"),
        ({"force_n": [1000.0] * 6}, "must be in N"),
        ({"force_n": [60.0] * 6}, "1 gf"),
        ({"baseline_kpa": [8000.0] * 6, "final_kpa": [9000.0] * 6}, "look like Pa"),
        ({"baseline_kpa": [80.0] * 6, "final_kpa": [90.0] * 6}, "look like hPa"),
        ({"final_kpa": [49.0] * 6}, "the force law has no solution"),
    ],
)
def test_a_row_that_is_not_a_contact_is_rejected_with_its_line(changed, expected):
    assert expected in error_message(read_contacts, points(**VALID | changed), SETTINGS)


INSTRUMENT_TABLES = {
    "export": ",".join(CONTACT_TYPES),
    "estimate": "place,baseline_kpa,final_kpa,force_n,force_std_n,valid,reason",
}


@pytest.mark.parametrize("names", INSTRUMENT_TABLES.values(), ids=INSTRUMENT_TABLES)
def test_the_forces_of_the_instrument_are_no_reference(names):
    """Such a calibration would confirm the instrument by its own forces."""
    row = ",".join("9" if name == "final_kpa" else "8" for name in names.split(","))
    assert "reference_n" in error_message(parse_contacts, f"{names}\n{row}\n".encode(), "own.csv")
    table = f"{names},reference_n\n{row},1.25\n"
    columns = parse_contacts(table.encode(), "own.csv").columns
    assert {name: list(values) for name, values in columns.items()} == {
        "baseline_kpa": [8.0],
        "final_kpa": [9.0],
        "force_n": [1.25],
    }


def test_five_contacts_are_too_few():
    contacts, _ = simulated_contacts(1, 5, **TRUTH)
    assert "5 contacts, and at least 6" in error_message(fit_force, contacts, SETTINGS)


def test_the_pressure_bins_count_exactly_the_contacts_from_1_to_3_5_n():
    calibration = fit_force(simulated_contacts(2, 60, **TRUTH)[0], SETTINGS)
    forces = calibration.contacts.force_n
    errors = errors_by_pressure(calibration.chosen.held_out_n, calibration.contacts)
    assert sum(each.contacts for each in errors) == sum((forces >= 1.0) & (forces <= 3.5))
    assert forces.max() > 3.5


def test_a_contact_on_the_edge_of_two_pressure_bins_belongs_to_the_lower_bin_only():
    contacts, _ = simulated_contacts(2, 60, **TRUTH)
    edge = BIN_EDGES_KPA[3]
    on_edge = replace(contacts, baseline_kpa=np.full(60, edge))
    [only] = errors_by_pressure(on_edge.law_n, on_edge)
    assert (only.low_kpa, only.high_kpa) == (BIN_EDGES_KPA[2], edge)


def test_the_step_of_the_law_is_an_edge_of_the_pressure_bins():
    switch_kpa = Balloon().switch_kpa
    assert switch_kpa in BIN_EDGES_KPA
    below, above = pressure_bin_indices(np.array([switch_kpa, np.nextafter(switch_kpa, 9)]))
    assert (below, above) == (2, 3)
