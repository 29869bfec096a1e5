"""Tests of the unexplained rise: slow rises of the locked pressure add up until they fall back."""

import math

import pytest

from pneuforce.instrument.measurement.unexplained_rise import (
    MAX_SLOW_KPA_PER_S,
    MAX_UNEXPLAINED_KPA,
    UnexplainedRise,
    max_slow_kpa_per_s,
)
from tests.instrument.measurement.test_contact import DT_S, NoisyTracker, PressureRamp


def before_kpa(ramp):
    return ramp.tracker.unexplained.before_kpa


def during_kpa(ramp):
    return ramp.tracker.unexplained.during_kpa


def test_a_slow_rise_without_contact_is_unexplained_until_the_pressure_falls_back():
    ramp = PressureRamp().to(8.4, 20.0).stay(5.0)
    assert ramp.tracker.contact_count == 0
    assert before_kpa(ramp) == pytest.approx(0.4, abs=0.02)
    assert before_kpa(ramp.to(8.1, 0.3).stay(5.0)) == pytest.approx(0.1, abs=0.02)
    assert before_kpa(ramp.to(7.9, 0.3).stay(5.0)) < 0.03


def test_above_the_limit_the_baseline_is_unknown_until_the_pressure_falls_back():
    ramp = PressureRamp().to(8.0 + MAX_UNEXPLAINED_KPA - 0.02, 60.0)
    assert not ramp.tracker.baseline_unknown
    ramp.to(8.0 + MAX_UNEXPLAINED_KPA + 0.05, 10.0)
    assert ramp.tracker.baseline_unknown
    assert not ramp.to(8.5, 10.0).stay(2.0).tracker.baseline_unknown


def test_an_unexplained_rise_of_nan_is_too_large():
    assert UnexplainedRise(during_kpa=math.nan).exceeded


def test_a_slow_press_that_hides_a_leak_is_unexplained():
    """The pressure is constant, because the press adds what the leak removes."""
    ramp = PressureRamp().to(7.4, 60.0)
    assert before_kpa(ramp) < 0.02
    assert before_kpa(ramp.stay(20.0)) == pytest.approx(20.0 * 0.01, abs=0.04)


def test_a_short_dip_after_a_contact_is_not_the_lowest_pressure():
    ramp = PressureRamp().to(9.5, 0.2).stay(1.0).to(7.9, 0.2).to(8.0, 0.3).stay(3.0)
    assert before_kpa(ramp) < 0.03


def test_a_contact_keeps_the_unexplained_rise_before_it():
    ramp = PressureRamp().to(8.3, 20.0).stay(5.0).to(9.5, 0.2).stay(3.0)
    assert (before_kpa(ramp), during_kpa(ramp)) == pytest.approx((0.3, 0.0), abs=0.03)
    ramp.to(8.3, 0.2).stay(3.0)
    assert (before_kpa(ramp), during_kpa(ramp)) == pytest.approx((0.3, 0.0), abs=0.03)


def test_a_top_up_keeps_the_unexplained_rise_and_a_vent_deletes_it():
    ramp = PressureRamp().to(8.3, 20.0).stay(2.0)
    for pressure_kpa in (8.3, 8.35, 8.4):
        ramp.tracker.step(pressure_kpa, pressure_kpa, False, DT_S)
    ramp.pressure_kpa = 8.4
    assert before_kpa(ramp.stay(2.0)) == pytest.approx(0.3, abs=0.02)
    ramp.tracker.step(0.0, 0.0, False, DT_S)
    ramp.tracker.empty()
    ramp.pressure_kpa = 8.0
    assert before_kpa(ramp.stay(2.0)) == 0.0


def test_a_contact_that_continues_over_a_change_of_the_setpoint_is_unexplained():
    ramp = PressureRamp().to(9.5, 0.2).stay(1.0)
    ramp.tracker.step(9.5, 9.5, False, DT_S)
    ramp.pressure_kpa = 10.5
    ramp.stay(1.0)
    assert before_kpa(ramp) == pytest.approx(1.5, abs=0.02)
    assert ramp.tracker.baseline_unknown
    assert not ramp.to(9.0, 0.3).stay(5.0).tracker.baseline_unknown


@pytest.mark.parametrize("change_kpa", [0.02, -0.02])
def test_the_change_by_a_proof_test_is_no_rise_and_no_drift(change_kpa):
    ramp = PressureRamp()
    for _ in range(20):
        ramp.tracker.pause(0.7)
        ramp.pressure_kpa += change_kpa
        ramp.stay(3.0)
    assert before_kpa(ramp) < 0.01
    assert ramp.tracker.drift_kpa_per_s == pytest.approx(0.0, abs=5e-4)
    assert ramp.tracker.baseline_kpa == pytest.approx(8.0 + 20 * change_kpa, abs=0.005)


@pytest.mark.parametrize("baseline_kpa", [5.3, 8.0, 11.0])
@pytest.mark.parametrize("share", [0.5, 0.9])
def test_a_slow_rise_of_a_contact_is_unexplained(share, baseline_kpa):
    rate = share * max_slow_kpa_per_s(baseline_kpa)
    ramp = PressureRamp(baseline_kpa).to(baseline_kpa + 5.0 * rate, 5.0)
    assert ramp.tracker.in_contact
    total_kpa = before_kpa(ramp) + during_kpa(ramp)
    assert total_kpa == pytest.approx(5.0 * rate, abs=0.03)


@pytest.mark.parametrize("baseline_kpa", [5.3, 8.0, 11.0])
def test_a_fast_rise_of_a_contact_is_explained(baseline_kpa):
    ramp = PressureRamp(baseline_kpa).to(baseline_kpa + 6.0 * max_slow_kpa_per_s(baseline_kpa), 3.0)
    ramp.stay(3.0)
    assert before_kpa(ramp) + during_kpa(ramp) < 0.06


def test_a_slow_rise_after_a_fast_press_is_unexplained_and_larger_because_the_balloon_is_pressed():
    ramp = PressureRamp().to(9.0, 0.3).stay(2.0).to(9.2, 10.0)
    assert during_kpa(ramp) == pytest.approx(1.7 * 0.2, abs=0.05)


def test_a_slow_fall_of_the_force_does_not_reduce_the_possible_drift():
    ramp = PressureRamp().to(10.0, 0.3).stay(2.0).to(10.2, 10.0)
    drift_kpa = during_kpa(ramp)
    assert drift_kpa > 0.2
    assert during_kpa(ramp.to(9.2, 20.0)) == pytest.approx(drift_kpa, abs=0.03)


def test_a_slow_rise_that_regains_a_slow_fall_is_a_force():
    ramp = PressureRamp().to(10.0, 0.3).stay(2.0)
    for _ in range(5):
        ramp.to(9.9, 3.0).to(10.0, 3.0)
    assert during_kpa(ramp) < 0.15


def test_the_slow_rise_of_a_contact_is_at_most_its_rise():
    ramp = PressureRamp().to(9.0, 0.3).to(9.5, 20.0).to(8.2, 0.3).stay(0.1)
    assert ramp.tracker.in_contact
    assert during_kpa(ramp) == pytest.approx(0.2, abs=0.03)


def test_a_rise_at_the_limit_of_the_rate_is_a_press():
    assert max_slow_kpa_per_s(8.0) == MAX_SLOW_KPA_PER_S
    assert max_slow_kpa_per_s(9.0) == max_slow_kpa_per_s(12.0) < MAX_SLOW_KPA_PER_S
    assert max_slow_kpa_per_s(5.0) == pytest.approx(8.0 / 5.0 * MAX_SLOW_KPA_PER_S)


@pytest.mark.parametrize("pressure_kpa", [8.0, 9.0])
def test_noise_is_no_unexplained_rise(pressure_kpa):
    """Without contact at 8 kPa, and in a contact with a rise of 1 kPa."""
    noisy = NoisyTracker(6)
    for _ in range(1000):
        noisy.step(8.0)
    for _ in range(60_000):
        noisy.step(pressure_kpa)
    unexplained = noisy.tracker.unexplained
    assert unexplained.before_kpa < 0.03
    assert unexplained.during_kpa < 0.03


def test_the_drift_before_a_contact_does_not_contain_the_beginning_of_the_contact():
    noisy = NoisyTracker(7)
    for _ in range(5000):
        noisy.step(8.0)
    for n in range(60_000):
        noisy.step(8.0 + 0.4 * min(n / 1000, 1.0))
    assert noisy.tracker.in_contact
    assert noisy.tracker.drifted_kpa < 0.03
    for _ in range(2500):
        noisy.step(8.0)
    assert (noisy.tracker.in_contact, noisy.tracker.baseline_unknown) == (False, False)
    assert noisy.tracker.contact_count == 1
