"""Tests of contact tracking: start and end of a contact, and the baseline pressure before the contact."""

import math
import random

import pytest

from pneuforce.instrument.measurement.contact import MAX_TRACKING_KPA_PER_S, ContactTracker
from pneuforce.instrument.measurement.contact_extremes import ContactExtremes
from pneuforce.instrument.measurement.lag import LagCompensator

DT_S = 0.002
#: Noise of a sample [kPa], which is the mean of 16 conversions with 0.7 counts rms each. One count of the
#: 10-bit ADC is (1/1024)/0.018 kPa.
NOISE_KPA = 0.7 / 1024 / 0.018 / math.sqrt(16)


class PressureRamp:
    """Contact tracker with a pressure that changes linearly from level to level, without noise."""

    def __init__(self, pressure_kpa=8.0):
        self.tracker = ContactTracker()
        self.pressure_kpa = pressure_kpa
        self.stay(1.0)

    def to(self, pressure_kpa, seconds):
        steps = max(1, round(seconds / DT_S))
        start = self.pressure_kpa
        for step in range(1, steps + 1):
            self.pressure_kpa = start + (pressure_kpa - start) * step / steps
            self.tracker.step(self.pressure_kpa, self.pressure_kpa, True, DT_S)
        return self

    def stay(self, seconds):
        return self.to(self.pressure_kpa, seconds)


def test_a_free_balloon_has_a_baseline_and_no_contact():
    tracker = PressureRamp().tracker
    assert (tracker.in_contact, tracker.contact_count, tracker.baseline_kpa) == (False, 0, 8.0)
    assert tracker.baseline_age_s == 0.0


@pytest.mark.parametrize("rise_s", [0.002, 0.05, 0.5])
def test_a_press_is_one_contact_with_the_pressure_before_it_as_baseline(rise_s):
    ramp = PressureRamp().to(9.0, rise_s).stay(1.0)
    assert (ramp.tracker.in_contact, ramp.tracker.contact_count) == (True, 1)
    assert ramp.tracker.baseline_kpa == pytest.approx(8.0, abs=0.01)
    ramp.to(8.0, rise_s).stay(0.5)
    assert (ramp.tracker.in_contact, ramp.tracker.contact_count, ramp.tracker.finished_count) == (False, 1, 1)


@pytest.mark.parametrize("end_kpa", [8.005, 7.99])
def test_after_a_contact_the_baseline_continues_at_its_end_pressure(end_kpa):
    tracker = PressureRamp().to(9.0, 0.1).to(end_kpa, 0.002).stay(3.0).tracker
    assert (tracker.in_contact, tracker.contact_count) == (False, 1)
    assert tracker.baseline_kpa == pytest.approx(end_kpa, abs=0.003)
    assert tracker.drift_kpa_per_s == pytest.approx(0.0, abs=0.01)


def test_the_baseline_is_the_minimum_before_the_rise():
    ramp = PressureRamp().to(7.7, 10.0).to(9.0, 0.2)
    assert ramp.tracker.baseline_kpa == pytest.approx(7.7, abs=0.01)


def test_the_baseline_is_measured_for_each_contact_while_the_balloon_leaks():
    ramp, baselines = PressureRamp(), []
    for level in (8.0, 7.9, 7.8):
        ramp.to(level, 10.0).to(level + 1, 0.1).stay(0.5)
        baselines.append(ramp.tracker.baseline_kpa)
        ramp.to(level, 0.1).stay(0.2)
    assert baselines == pytest.approx([8.0, 7.9, 7.8], abs=0.01)
    assert ramp.tracker.contact_count == ramp.tracker.finished_count == 3


@pytest.mark.parametrize("trough_kpa", [8.05, 8.1, 8.2, 8.28])
def test_an_upturn_after_a_deep_trough_is_a_new_contact(trough_kpa):
    ramp = PressureRamp().to(9.0, 0.1).stay(0.3).to(trough_kpa, 0.05)
    assert ramp.tracker.contact_count == 1
    ramp.to(9.2, 0.1)
    assert (ramp.tracker.in_contact, ramp.tracker.contact_count, ramp.tracker.finished_count) == (True, 2, 1)
    assert ramp.tracker.baseline_kpa == pytest.approx(8.0, abs=0.005)


@pytest.mark.parametrize("eased_kpa", [8.9, 8.6, 8.4, 8.33])
def test_an_upturn_after_a_shallow_trough_is_the_same_contact(eased_kpa):
    ramp = PressureRamp()
    for _ in range(5):
        ramp.to(9.0, 0.1).to(eased_kpa, 0.2)
    ramp.to(10.0, 0.2)
    assert (ramp.tracker.contact_count, ramp.tracker.finished_count) == (1, 0)
    assert ramp.tracker.baseline_kpa == pytest.approx(8.0, abs=0.01)


@pytest.mark.parametrize("kpa_per_s", [0.9 * MAX_TRACKING_KPA_PER_S, 0.01, -0.01, -0.1])
def test_a_pressure_that_rises_slower_than_the_limit_is_drift(kpa_per_s):
    ramp = PressureRamp().to(8.0 + 5.0 * kpa_per_s, 5.0).to(8.0 + 2 * 5.0 * kpa_per_s, 5.0)
    assert ramp.tracker.contact_count == 0
    assert ramp.tracker.drift_kpa_per_s == pytest.approx(kpa_per_s, rel=0.2)


def test_the_release_of_an_object_that_pressed_at_the_lock_is_no_drift():
    """Otherwise the baseline falls during the next contact as by a leak, and the contact never ends."""
    ramp = PressureRamp(10.2).to(8.0, 0.7).stay(2.0).to(11.4, 0.3).stay(1.2)
    assert ramp.tracker.baseline_kpa == pytest.approx(8.0, abs=0.02)
    assert ramp.to(8.0, 0.3).stay(2.0).tracker.in_contact is False
    assert ramp.tracker.drift_kpa_per_s == pytest.approx(0.0, abs=0.01)


def test_a_pressure_that_rises_faster_than_the_limit_is_a_contact():
    assert PressureRamp().to(8.0 + 30 * 1.2 * MAX_TRACKING_KPA_PER_S, 30.0).tracker.contact_count == 1


def test_the_baseline_of_a_contact_includes_the_drift_before_it():
    ramp = PressureRamp().to(8.2, 20.0).to(9.2, 0.1)
    assert ramp.tracker.baseline_kpa == pytest.approx(8.2, abs=0.03)


def test_leaving_the_locked_state_ends_the_contact_and_resets_the_baseline():
    ramp = PressureRamp().to(9.0, 0.1)
    ramp.tracker.step(9.0, 9.0, False, DT_S)
    tracker = ramp.tracker
    assert (tracker.in_contact, tracker.contact_count, tracker.finished_count) == (False, 1, 1)
    assert math.isnan(tracker.baseline_kpa)
    assert math.isnan(tracker.drift_kpa_per_s)
    ramp.stay(0.1)
    assert (tracker.in_contact, tracker.baseline_kpa) == (False, 9.0)


@pytest.mark.parametrize("invalid_kpa", [math.nan, math.inf, -math.inf])
def test_an_invalid_pressure_ends_the_contact_and_resets_the_baseline(invalid_kpa):
    ramp = PressureRamp().to(9.0, 0.1)
    ramp.tracker.step(invalid_kpa, invalid_kpa, True, DT_S)
    assert not ramp.tracker.in_contact
    assert math.isnan(ramp.tracker.baseline_kpa)
    ramp.stay(0.1)
    assert ramp.tracker.baseline_kpa == 9.0


def test_the_age_of_the_baseline_is_the_time_since_the_balloon_was_free():
    ramp = PressureRamp().to(9.0, 0.002).stay(3.0)
    assert ramp.tracker.baseline_age_s == pytest.approx(3.0, abs=0.01)
    ramp.to(8.0, 0.1).stay(0.2)
    assert ramp.tracker.baseline_age_s == 0.0


class NoisyTracker:
    """Contact tracker with tube, lag compensator and the noise of the ADC."""

    def __init__(self, seed, tube_time_constant_s=0.06):
        self.tracker, self.lag, self.gauss = (
            ContactTracker(),
            LagCompensator(tube_time_constant_s),
            random.Random(seed).gauss,
        )
        self.response, self.sensor_kpa = 1 - math.exp(-DT_S / tube_time_constant_s), 8.0

    def step(self, pressure_kpa):
        self.sensor_kpa += self.response * (pressure_kpa - self.sensor_kpa)
        reading_kpa = self.sensor_kpa + self.gauss(0.0, NOISE_KPA)
        now_kpa = self.lag.step(reading_kpa, DT_S)
        self.tracker.step(self.lag.smoothed_kpa, now_kpa, True, DT_S)


@pytest.mark.parametrize("seed", [1, 2])
def test_ten_minutes_of_noise_give_no_contact_and_hardly_move_the_baseline(seed):
    noisy = NoisyTracker(seed)
    for _ in range(300_000):
        noisy.step(8.0)
    assert noisy.tracker.contact_count == 0
    assert noisy.tracker.baseline_kpa == pytest.approx(8.0, abs=0.012)


def test_each_light_touch_in_noise_is_one_contact_that_ends():
    noisy = NoisyTracker(3)
    for step in range(60 * 500):
        noisy.step(8.0 + 0.15 * ((step // 500) % 2))
    assert noisy.tracker.contact_count == 30
    assert noisy.tracker.finished_count in (29, 30)


def test_a_long_light_press_in_noise_is_one_contact():
    noisy = NoisyTracker(4)
    for step in range(4 * 12 * 500):
        noisy.step(8.0 + (0.1 * min(1, (step % 6000 - 1000) / 200) if step // 500 % 12 >= 2 else 0.0))
    assert noisy.tracker.contact_count == 4


@pytest.mark.parametrize(
    ("smoothed_kpa", "is_new"),
    [((8.16, 8.145, 8.15), False), ((8.16, 8.05, 8.06), False), ((8.16, 8.05, 8.09), True)],
)
def test_the_smoothed_reading_must_show_the_trough_and_the_upturn(smoothed_kpa, is_new):
    extremes = ContactExtremes.start(8.15, 8.15)
    steps = [extremes.step(*pair, 8.0) for pair in zip((8.24, 8.06, 8.2), smoothed_kpa, strict=True)]
    assert steps == [False, False, is_new]


@pytest.mark.parametrize("trough_s", [0.04, 0.1, 0.5])
def test_a_short_deep_trough_in_noise_separates_two_contacts(trough_s):
    noisy = NoisyTracker(5)
    for pressure_kpa, seconds in ((8.0, 1.0), (9.0, 0.3), (8.05, trough_s), (9.2, 0.3), (8.0, 1.0)):
        for _ in range(round(seconds / DT_S)):
            noisy.step(pressure_kpa)
    assert noisy.tracker.contact_count == 2


@pytest.mark.parametrize("kpa_per_s", [0.05, 0.1, 0.5])
def test_a_slow_press_hardly_moves_its_baseline(kpa_per_s):
    ramp = PressureRamp().to(8.0 + 3 * kpa_per_s, 3.0)
    assert ramp.tracker.contact_count == 1
    assert ramp.tracker.baseline_kpa == pytest.approx(8.0, abs=0.02)


def test_a_contact_ends_although_the_balloon_drifted_during_the_contact():
    ramp = PressureRamp().to(8.4, 20.0).to(10.0, 0.2).stay(5.0)
    assert ramp.tracker.contact_count == 1
    ramp.to(8.5, 0.2).stay(0.5)
    assert not ramp.tracker.in_contact
