"""Tests of the peaks of a validation as the instrument measures them: no lag, no noise of the reference."""

from dataclasses import replace

import numpy as np
import pytest

from pneuforce.instrument.validation.contacts import find_contacts
from pneuforce.instrument.validation.instrument_peaks import average_force
from pneuforce.instrument.validation.processed_trial import process_trials
from tests.instrument.validation.synthetic_trials import BASELINE_KPA, KPA_PER_N, SETTINGS, force_n, trial

NOISE_KPA = 0.002
TAPS = [(1.0, 0.15, 0.05, 1.0), (2.5, 0.15, 0.05, 2.0), (4.0, 0.15, 0.05, 3.0)]


def contacts(tried):
    [processed] = process_trials([tried], SETTINGS)
    return find_contacts(processed, SETTINGS)


def test_the_peak_of_a_tap_has_neither_the_lag_of_the_tube_nor_that_of_the_filter():
    found = contacts(trial(*force_n(6.0, *TAPS), noise_kpa=NOISE_KPA))
    assert len(found) == len(TAPS)
    for contact, (*_, peak_n) in zip(found, TAPS, strict=True):
        peak = contact.instrument
        assert peak.reference_n == pytest.approx(peak_n, rel=0.005)
        assert peak.baseline_kpa == pytest.approx(BASELINE_KPA, abs=0.02)
        assert peak.final_kpa - peak.baseline_kpa == pytest.approx(KPA_PER_N * peak_n, rel=0.02)
        assert contact.final_kpa - contact.baseline_kpa < 0.9 * KPA_PER_N * peak_n


def test_the_peak_of_a_recording_with_100_samples_per_second_is_that_of_500():
    tried = trial(*force_n(4.0, (1.0, 0.3, 0.5, 2.0)))
    rarely = replace(
        tried, **{name: getattr(tried, name)[::5] for name in ("t_s", "pressure_kpa", "force_n")}
    )
    [often], [seldom] = contacts(tried), contacts(rarely)
    assert seldom.instrument == pytest.approx(often.instrument, rel=0.01)


def test_at_the_end_of_a_trial_the_peak_has_the_pressure_without_lag():
    [contact] = contacts(trial(*force_n(1.3, (1.0, 0.3, 0.5, 2.0))))  # the trial ends when the force is 2 N
    peak = contact.instrument
    assert peak.final_kpa - peak.baseline_kpa == pytest.approx(2 * KPA_PER_N, rel=0.05)
    assert contact.final_kpa - contact.baseline_kpa < 1.6 * KPA_PER_N


def test_a_contact_that_is_too_short_for_a_peak_has_the_pressure_of_its_highest_sample():
    [contact] = contacts(trial(*force_n(3.0, (1.0, 0.02, 0.0, 1.0))))
    assert contact.instrument.final_kpa > BASELINE_KPA + 0.5 * KPA_PER_N
    assert contact.final_kpa < BASELINE_KPA + 0.2 * KPA_PER_N


def test_the_noise_of_the_reference_does_not_raise_its_peak():
    tried = trial(*force_n(4.0, (1.0, 0.3, 1.0, 2.0)))
    noisy_n = tried.force_n + np.random.default_rng(1).normal(0.0, 0.02, len(tried.t_s))
    assert noisy_n.max() > 2.04
    averaged_n = average_force(replace(tried, force_n=noisy_n))
    assert len(averaged_n) == len(noisy_n)
    assert averaged_n.max() == pytest.approx(2.0, abs=0.02)
