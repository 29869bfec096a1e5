"""The force calibration: what was put in comes out, no more terms than the contacts support, no harm done."""

from dataclasses import replace

import numpy as np
import pytest

from instrument.calibration.contacts import Contacts, contacts_in
from instrument.calibration.force import calibration_of
from instrument.calibration.residuals import bins, share_and_floor
from instrument.chain import ChainSettings
from instrument.fifths import EDGES_KPA, fifths_of
from instrument.model import Balloon, Correction, estimate
from tests.instrument.calibration.points import points, refusal_of, share_within

OWN = ChainSettings()
TERMS = ("constant", "by_rise", "by_initial", "by_both", "by_step")
TRUTH = {"constant": -0.2, "by_rise": 0.3, "by_initial": -0.05, "by_both": 0.05}
WIDE = {"rise_span_kpa": (0.01, 20.0), "initial_span_kpa": (2.0, 12.0)}


def distorted(seed, count=24, noise=0.02, cell_n=0.0, own=OWN, **terms):
    """Contacts of a balloon that obeys the law, times a correction, within some noise."""
    lot = np.random.default_rng(seed)
    initial, rise = lot.uniform(5, 11.4, count), np.exp(lot.uniform(np.log(0.3), np.log(4), count))
    law_n = estimate(initial, initial + rise, own.balloon, own.circuit, own.law).force_n
    truth_n = law_n * Correction(**dict.fromkeys(TERMS, 0.0) | terms, **WIDE, law=own.law).factor(
        rise, initial
    )
    force = truth_n * np.exp(lot.normal(0, noise, count)) + lot.normal(0, cell_n, count)
    return Contacts(
        initial, rise, force, np.full(count, cell_n), law_n, own.law.small_strain(initial, own.balloon)
    ), truth_n


def test_the_terms_that_were_put_in_lie_within_their_stated_uncertainty():
    draws = [calibration_of(distorted(n, **TRUTH)[0], OWN) for n in range(60)]
    right = [draw for draw in draws if draw.chosen.terms == TERMS[:4]]
    assert len(right) >= 40
    for k, term in enumerate(TERMS[:4]):
        errors = [draw.fit.coefficients[k] - TRUTH[term] for draw in right]
        assert 0.5 <= share_within(errors, [draw.fit.stds[k] for draw in right]) <= 0.86


def test_the_residual_is_what_the_force_of_an_unseen_contact_is_off_by():
    within = []
    for seed in range(30):
        found = calibration_of(distorted(seed, noise=0.04, **TRUTH)[0], OWN)
        share, floor_n = share_and_floor(found.chosen.unseen_n, found.contacts)
        fresh, _ = distorted(1000 + seed, count=50, noise=0.04, **TRUTH)
        force_n = fresh.law_n * found.correction.factor(fresh.rise_kpa, fresh.initial_kpa)
        within.append(share_within(force_n - fresh.force_n, np.hypot(share * force_n, floor_n)))
    assert 0.58 <= np.mean(within) <= 0.8


@pytest.mark.parametrize("terms", [1, 2, 3])
def test_no_more_terms_are_taken_than_there_are(terms):
    truth = dict(list(TRUTH.items())[:terms])
    taken = [len(calibration_of(distorted(n, **truth)[0], OWN).chosen.terms) for n in range(20)]
    assert taken.count(terms) >= 12
    assert min(taken) >= terms - 1


def test_few_contacts_carry_few_terms():
    for count in (6, 8, 9, 11, 12, 14):
        found = calibration_of(distorted(1, count, **TRUTH)[0], OWN)
        assert max(len(c.terms) for c in found.candidates) <= count // 3


def test_a_correction_that_gains_nothing_is_refused_and_said():
    said = refusal_of(calibration_of, distorted(3, noise=0.08)[0], OWN)
    assert said.startswith("no calibration: the bare law errs by ")
    assert "nothing was written" in said


def test_one_setpoint_teaches_no_slope_over_setpoints():
    contacts, _ = distorted(1, **TRUTH)
    same = replace(contacts, initial_kpa=np.full(24, 8.0))
    assert all(not {"by_initial", "by_both"} & set(c.terms) for c in calibration_of(same, OWN).candidates)


def test_a_force_that_would_fall_while_the_pressure_rises_is_refused():
    said = refusal_of(calibration_of, distorted(1, noise=0.001, by_rise=-0.9, constant=0.3)[0], OWN)
    assert "would fall as the pressure rises" in said


def test_a_cell_that_is_unsure_of_small_forces_is_believed_less_there():
    contacts, _ = distorted(5, noise=0.001, constant=0.2)
    off = contacts.force_n * np.where(contacts.force_n < 1.2, 1.5, 1.0)
    std = np.where(contacts.force_n < 1.2, 0.5 * contacts.force_n, 0.001)
    found = calibration_of(replace(contacts, force_n=off, std_n=std), OWN)
    large = contacts.only(contacts.force_n > 1.5)
    factor = found.correction.factor(large.rise_kpa, large.initial_kpa)
    assert factor == pytest.approx(np.full(len(large), np.exp(0.2)), rel=0.03)


GOOD = {"initial_kpa": [8.0] * 6, "final_kpa": [9.0] * 6, "force_n": [1.0] * 6}


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"initial_kpa": [8, 8, 4.9, 8, 8, 8]}, "line 4: initial_kpa is outside 4.95 to 11.45 kPa"),
        ({"final_kpa": [9, 8.01, 9, 9, 9, 9]}, "line 3: final_kpa is not 0.06 kPa above"),
        ({"force_n": [1, 1, 1, 1, 1, 0]}, "line 7: force_n is not above 0"),
        ({"force_n": [1, 1, 1, 1, 1, -1]}, "line 7: force_n"),
        ({"force_n": [1, 1, 21, 1, 1, 1]}, "line 4: force_n is not above 0 and up to 20 N"),
        ({"force_n": [1000.0] * 6}, "look like mN"),
        ({"initial_kpa": [8000.0] * 6, "final_kpa": [9000.0] * 6}, "look like Pa"),
        ({"initial_kpa": [80.0] * 6, "final_kpa": [90.0] * 6}, "look like hPa"),
        ({"final_kpa": [49.0] * 6}, "the law has no force"),
    ],
)
def test_what_is_no_contact_is_refused_with_its_line(changed, said):
    assert said in refusal_of(contacts_in, points(**GOOD | changed), OWN)


def test_five_contacts_are_too_few():
    assert "5 contacts, and at least 6" in refusal_of(calibration_of, distorted(1, 5, **TRUTH)[0], OWN)


def test_the_bins_hold_every_contact_of_1_to_3_5_n_and_no_other():
    found = calibration_of(distorted(2, 60, **TRUTH)[0], OWN)
    forces = found.contacts.force_n
    assert sum(b.contacts for b in bins(found.chosen.unseen_n, found.contacts)) == sum(
        (forces >= 1.0) & (forces <= 3.5)
    )
    assert forces.max() > 3.5


def test_a_contact_on_the_edge_of_two_fifths_counts_once_and_with_the_lower():
    contacts, _ = distorted(2, 60, **TRUTH)
    edge = EDGES_KPA[3]
    on_edge = replace(contacts, initial_kpa=np.full(60, edge))
    [only] = bins(on_edge.law_n, on_edge)
    assert (only.low_kpa, only.high_kpa) == (EDGES_KPA[2], edge)


def test_the_step_of_the_law_lies_between_two_fifths():
    assert Balloon().switch_kpa in EDGES_KPA
    below, above = fifths_of(np.array([Balloon().switch_kpa, np.nextafter(Balloon().switch_kpa, 9)]))
    assert (below, above) == (2, 3)
