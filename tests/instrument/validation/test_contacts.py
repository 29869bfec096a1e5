"""Tests of the contacts of a trial: ΔP_i, ΔP_f and peak of the true force, as defined in the paper."""

import numpy as np
import pytest

from tests.instrument.validation.synthetic_trials import BASELINE_KPA, KPA_PER_N, contacts, force_n


def test_a_slow_contact_has_its_baseline_pressure_its_peak_pressure_and_its_peak_force():
    [contact] = contacts(*force_n(5.0, (1.0, 0.5, 1.0, 2.0)))
    assert contact.baseline_kpa == pytest.approx(BASELINE_KPA, abs=1e-3)
    assert contact.final_kpa == pytest.approx(BASELINE_KPA + 2 * KPA_PER_N, abs=1e-3)
    assert contact.force_n == pytest.approx(2.0, abs=1e-3)
    assert contact.initial_s <= 1.1
    assert 1.5 < contact.final_s < 3.2


def test_the_peak_of_a_contact_does_not_depend_on_earlier_contacts():
    peaks_n = (0.3, 3.0, 0.6, 2.0)
    found = contacts(*force_n(16.0, *((1 + 3.5 * n, 0.5, 1.0, peak) for n, peak in enumerate(peaks_n))))
    assert [contact.force_n for contact in found] == pytest.approx(peaks_n, abs=1e-3)
    assert [c.final_kpa - c.baseline_kpa for c in found] == pytest.approx(
        [KPA_PER_N * n for n in peaks_n], abs=2e-3
    )


def test_the_baseline_of_an_overlapping_contact_is_the_trough_of_the_filtered_pressure():
    first, second = contacts(*force_n(5.0, (1.0, 0.3, 0.3, 2.5), (1.9, 0.3, 0.3, 1.5)))
    assert first.baseline_kpa == pytest.approx(BASELINE_KPA, abs=1e-3)
    assert BASELINE_KPA + 0.05 < second.baseline_kpa < BASELINE_KPA + 0.6
    assert second.final_kpa == pytest.approx(BASELINE_KPA + 1.5 * KPA_PER_N, abs=0.08)
    assert second.force_n == pytest.approx(1.5, abs=0.03)
    assert first.final_s < second.initial_s < second.final_s


def test_noise_changes_the_pressures_by_no_more_than_its_standard_deviation():
    [contact] = contacts(*force_n(5.0, (1.0, 0.5, 1.0, 2.0)), noise_kpa=0.01)
    assert contact.baseline_kpa == pytest.approx(BASELINE_KPA, abs=0.01)
    assert contact.final_kpa == pytest.approx(BASELINE_KPA + 2 * KPA_PER_N, abs=0.01)


def test_a_recording_of_noise_has_no_contact():
    assert contacts(*force_n(5.0), noise_kpa=0.01) == []


def test_a_contact_that_continues_at_the_end_of_the_recording_is_found():
    [contact] = contacts(*force_n(2.5, (1.0, 0.5, 5.0, 2.0)))
    assert contact.force_n == pytest.approx(2.0, abs=0.01)


def test_contacts_are_cut_until_the_object_of_the_start_of_the_trial_is_removed():
    t_s, force = force_n(14.0, (1.5, 0.3, 0.3, 2.0), (5.0, 0.3, 0.3, 2.0), (9.0, 0.3, 0.3, 2.0))
    force = np.maximum(force, np.where(t_s < 7.0, 0.5, 0.0))
    found = contacts(t_s, force)
    assert [contact.cut for contact in found] == [True, True, False]
    assert found[2].baseline_kpa == pytest.approx(BASELINE_KPA, abs=0.02)
    assert found[1].baseline_kpa == pytest.approx(BASELINE_KPA + 0.5 * KPA_PER_N, abs=0.02)


def test_a_press_at_the_end_of_a_free_trial_is_not_cut():
    found = contacts(*force_n(12.0, (0.1, 0.3, 0.3, 2.0), (1.0, 0.3, 5.0, 1.0)))
    assert not any(contact.cut for contact in found)
