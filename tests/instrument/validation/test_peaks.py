"""Errors of the peak force, on contacts whose answer is known."""

import math

import numpy as np
import pytest

from instrument.chain import ChainSettings
from instrument.model import Balloon, Circuit, Law, estimate
from instrument.validation.contacts import PickedContact
from instrument.validation.paper import ALL, FIFTHS, GROUPS, SMALL, STIFF, USUAL
from instrument.validation.peaks import Peaks, errors_of, peaks_kept, volume_change

SETTINGS = ChainSettings(law=Law())


def contact(initial_kpa, rise_kpa, force_n=1.0):
    return PickedContact(initial_kpa, initial_kpa + rise_kpa, force_n, 0.0, 1.0)


def peaks(initial_kpa, force_n, energetic_n):
    other = np.full(len(force_n), np.nan)
    estimates = {"energetic": np.array(energetic_n), "lulevich": other, "shanahan": other}
    initial = np.array(initial_kpa)
    return Peaks(initial, initial + 1, np.array(force_n), np.full(len(initial), 0.1), estimates)


def test_the_mean_error_takes_each_contact_over_its_own_force():
    [errors] = errors_of(peaks([6, 6, 6], [1.0, 2.0, 4.0], [1.1, 1.6, 4.0]), [ALL])
    energetic = errors.by_method["energetic"]
    assert energetic.absolute_percent == pytest.approx((10 + 20 + 0) / 3)
    assert energetic.signed_percent == pytest.approx((10 - 20 + 0) / 3)
    assert (errors.contacts, energetic.solved, energetic.printed_percent) == (3, 3, 9.14)


def test_a_contact_without_a_solution_is_told_and_not_averaged():
    [errors] = errors_of(peaks([6, 6], [1.0, 2.0], [1.1, math.nan]), [ALL])
    assert (errors.contacts, errors.by_method["energetic"].solved) == (2, 1)
    assert errors.by_method["energetic"].absolute_percent == pytest.approx(10)
    assert math.isnan(errors.by_method["lulevich"].absolute_percent)


def test_each_contact_is_in_one_fifth_and_the_last_two_are_those_above_8_85():
    initial = np.linspace(4.86, 11.54, 500)
    inside = np.array([fifth.selects(initial, initial, initial) for fifth in FIFTHS])
    assert (inside.sum(axis=0) == 1).all()
    stiff = STIFF.selects(initial, initial, initial)
    assert (inside[3:].any(axis=0) == stiff).all()


def test_forces_below_1_n_are_left_out_of_the_papers_range():
    [errors] = errors_of(peaks([6, 6, 6], [0.8, 1.0, 3.5], [1.6, 1.1, 3.5]), [USUAL])
    assert errors.contacts == 2
    assert errors.by_method["energetic"].absolute_percent == pytest.approx(5)


def test_the_papers_printed_errors_stand_beside_their_groups_and_nowhere_else():
    printed = {group.name: dict(group.printed) for group in GROUPS if group.printed}
    assert printed == {
        ALL.name: {"energetic": 9.14},
        USUAL.name: {"energetic": 9.14},
        STIFF.name: {"energetic": 6.77, "lulevich": 14.15, "shanahan": 14.12},
        SMALL.name: {"lulevich": 43.88, "shanahan": 52.27},
    }


def test_the_volume_change_is_that_of_the_whole_gas_over_the_sphere():
    # by hand at 8 → 10 kPa: R_i = 8.2423 mm, V_si = 2345.4 mm³, V_i = 15025.4 mm³
    change = volume_change(np.array([8.0]), np.array([10.0]), Balloon(), Circuit())
    assert change[0] == pytest.approx((1 - 109.325 / 111.325) * 15025.4 / 2345.4, rel=1e-4)


def test_contacts_are_excluded_for_the_first_reason_that_applies():
    contacts = [
        contact(8.0, 0.4),
        contact(3.0, 0.4),
        contact(3.0, 1.0),
        contact(11.6, 1.0),
        contact(8.0, 1.0, 0.01),
        contact(8.0, 1.0, math.nan),
        contact(8.0, 1.0),
        contact(4.9, 1.0),
    ]
    kept, counts = peaks_kept(contacts, SETTINGS)
    assert counts._asdict() == {
        "found": 8,
        "too_small": 2,
        "out_of_range": 2,
        "without_force": 2,
        "evaluated": 2,
    }
    assert kept.initial_kpa.tolist() == [8.0, 4.9]


def test_close_to_the_step_the_chosen_law_is_used():
    errors = []
    for switch in ("paper", "blend"):
        kept, _ = peaks_kept([contact(8.86, 1.0)], ChainSettings(law=Law(switch=switch)))
        errors.append(kept.errors_percent("energetic")[0])
    assert abs(errors[1] - errors[0]) > 1


def test_no_contacts_are_no_error():
    kept, counts = peaks_kept([], SETTINGS)
    assert counts.found == 0
    assert all(group.contacts == 0 for group in errors_of(kept))


@pytest.mark.parametrize("method", ["energetic", "lulevich", "shanahan"])
def test_a_world_that_obeys_a_method_has_no_error_by_it(method):
    initial, rise = np.array([5.0, 7.0, 9.0, 11.0]), np.array([0.6, 1.0, 2.0, 3.0])
    force = estimate(initial, initial + rise, Balloon(), Circuit(), Law(method=method)).force_n
    kept, _ = peaks_kept([contact(*each) for each in zip(initial, rise, force, strict=True)], SETTINGS)
    [errors] = errors_of(kept, [ALL])
    by_method = {name: told.absolute_percent for name, told in errors.by_method.items()}
    assert by_method.pop(method) < 1e-9
    assert min(by_method.values()) > 5
