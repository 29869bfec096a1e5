"""Contact tracking: when a contact begins and ends, and the pressure before it."""

import math
import random

import pytest

from instrument.contact import TRACKING_KPA_PER_S, ContactTracker
from instrument.lag import LagCompensator

DT_S = 0.002
#: 0.7 counts rms of a 10-bit ADC, 16 conversions averaged; a count is 1/1024/0.018 kPa.
NOISE_KPA = 0.7 / 1024 / 0.018 / math.sqrt(16)


class Press:
    """A tracker, and a locked pressure that goes from level to level in straight lines."""

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
    tracker = Press().tracker
    assert (tracker.in_contact, tracker.count, tracker.initial_kpa) == (False, 0, 8.0)
    assert tracker.baseline_age_s == 0.0


@pytest.mark.parametrize("rise_s", [0.002, 0.05, 0.5])
def test_a_press_is_one_contact_with_the_pressure_before_it(rise_s):
    press = Press().to(9.0, rise_s).stay(1.0)
    assert (press.tracker.in_contact, press.tracker.count) == (True, 1)
    assert press.tracker.initial_kpa == pytest.approx(8.0, abs=0.01)
    press.to(8.0, rise_s).stay(0.5)
    assert (press.tracker.in_contact, press.tracker.count, press.tracker.finished) == (False, 1, 1)


@pytest.mark.parametrize("end_kpa", [8.005, 7.99])
def test_the_baseline_goes_on_where_a_contact_ended(end_kpa):
    tracker = Press().to(9.0, 0.1).to(end_kpa, 0.002).stay(3.0).tracker
    assert (tracker.in_contact, tracker.count) == (False, 1)
    assert tracker.initial_kpa == pytest.approx(end_kpa, abs=0.003)
    assert tracker.drift_kpa_per_s == pytest.approx(0.0, abs=0.01)


def test_the_initial_pressure_is_the_minimum_before_the_rise():
    press = Press().to(7.7, 10.0).to(9.0, 0.2)
    assert press.tracker.initial_kpa == pytest.approx(7.7, abs=0.01)


def test_it_is_measured_anew_for_each_contact_while_the_balloon_leaks():
    press, seen = Press(), []
    for level in (8.0, 7.9, 7.8):
        press.to(level, 10.0).to(level + 1, 0.1).stay(0.5)
        seen.append(press.tracker.initial_kpa)
        press.to(level, 0.1).stay(0.2)
    assert seen == pytest.approx([8.0, 7.9, 7.8], abs=0.01)
    assert press.tracker.count == press.tracker.finished == 3


@pytest.mark.parametrize("trough_kpa", [8.05, 8.1, 8.2, 8.28])
def test_a_contact_that_comes_before_the_pressure_has_recovered_is_a_new_one(trough_kpa):
    press = Press().to(9.0, 0.1).stay(0.3).to(trough_kpa, 0.05)
    assert press.tracker.count == 1
    press.to(9.2, 0.1)
    assert (press.tracker.in_contact, press.tracker.count, press.tracker.finished) == (True, 2, 1)
    assert press.tracker.initial_kpa == pytest.approx(8.0, abs=0.005)


@pytest.mark.parametrize("eased_kpa", [8.9, 8.6, 8.4, 8.33])
def test_an_easing_hand_is_not_a_new_contact(eased_kpa):
    press = Press()
    for _ in range(5):
        press.to(9.0, 0.1).to(eased_kpa, 0.2)
    press.to(10.0, 0.2)
    assert (press.tracker.count, press.tracker.finished) == (1, 0)
    assert press.tracker.initial_kpa == pytest.approx(8.0, abs=0.01)


@pytest.mark.parametrize("kpa_per_s", [0.9 * TRACKING_KPA_PER_S, 0.01, -0.01, -0.1, -1.0])
def test_a_pressure_that_drifts_slower_than_stated_is_no_contact(kpa_per_s):
    press = Press().to(8.0 + 5.0 * kpa_per_s, 5.0).to(8.0 + 2 * 5.0 * kpa_per_s, 5.0)
    assert press.tracker.count == 0
    assert press.tracker.drift_kpa_per_s == pytest.approx(kpa_per_s, rel=0.2)


def test_a_pressure_that_rises_faster_than_stated_is_a_contact():
    assert Press().to(8.0 + 30 * 1.2 * TRACKING_KPA_PER_S, 30.0).tracker.count == 1


def test_a_contact_after_drift_starts_from_where_the_drift_led():
    press = Press().to(8.2, 20.0).to(9.2, 0.1)
    assert press.tracker.initial_kpa == pytest.approx(8.2, abs=0.03)


def test_leaving_the_locked_state_ends_the_contact_and_forgets_the_baseline():
    press = Press().to(9.0, 0.1)
    press.tracker.step(9.0, 9.0, False, DT_S)
    tracker = press.tracker
    assert (tracker.in_contact, tracker.count, tracker.finished) == (False, 1, 1)
    assert math.isnan(tracker.initial_kpa)
    assert math.isnan(tracker.drift_kpa_per_s)
    press.stay(0.1)
    assert (tracker.in_contact, tracker.initial_kpa) == (False, 9.0)


@pytest.mark.parametrize("broken", [math.nan, math.inf, -math.inf])
def test_a_broken_pressure_ends_the_contact_and_the_next_good_one_begins_anew(broken):
    press = Press().to(9.0, 0.1)
    press.tracker.step(broken, broken, True, DT_S)
    assert not press.tracker.in_contact
    assert math.isnan(press.tracker.initial_kpa)
    press.stay(0.1)
    assert press.tracker.initial_kpa == 9.0


def test_the_age_of_the_baseline_is_the_time_since_the_balloon_was_free():
    press = Press().to(9.0, 0.002).stay(3.0)
    assert press.tracker.baseline_age_s == pytest.approx(3.0, abs=0.01)
    press.to(8.0, 0.1).stay(0.2)
    assert press.tracker.baseline_age_s == 0.0


class Noisy:
    """A tracker behind the tube's lag, with the noise of the ADC."""

    def __init__(self, seed, tube_s=0.06):
        self.tracker, self.lag, self.gauss = (
            ContactTracker(),
            LagCompensator(tube_s),
            random.Random(seed).gauss,
        )
        self.share, self.sensor_kpa = 1 - math.exp(-DT_S / tube_s), 8.0

    def step(self, pressure_kpa):
        self.sensor_kpa += self.share * (pressure_kpa - self.sensor_kpa)
        reading_kpa = self.sensor_kpa + self.gauss(0.0, NOISE_KPA)
        now_kpa = self.lag.step(reading_kpa, DT_S)
        self.tracker.step(self.lag.calm_kpa, now_kpa, True, DT_S)


@pytest.mark.parametrize("seed", [1, 2])
def test_noise_makes_no_contact_in_ten_minutes_and_hardly_moves_the_baseline(seed):
    noisy = Noisy(seed)
    for _ in range(300_000):
        noisy.step(8.0)
    assert noisy.tracker.count == 0
    assert noisy.tracker.initial_kpa == pytest.approx(8.0, abs=0.012)


def test_a_light_touch_in_noise_is_one_contact_that_ends():
    noisy = Noisy(3)
    for step in range(60 * 500):
        noisy.step(8.0 + 0.15 * ((step // 500) % 2))
    assert noisy.tracker.count == 30
    assert noisy.tracker.finished in (29, 30)


@pytest.mark.parametrize("kpa_per_s", [0.05, 0.1, 0.5])
def test_a_slow_press_hardly_takes_its_baseline_along(kpa_per_s):
    press = Press().to(8.0 + 3 * kpa_per_s, 3.0)
    assert press.tracker.count == 1
    assert press.tracker.initial_kpa == pytest.approx(8.0, abs=0.02)


def test_a_contact_ends_though_the_balloon_drifted_while_it_lasted():
    press = Press().to(8.4, 20.0).to(10.0, 0.2).stay(5.0)
    assert press.tracker.count == 1
    press.to(8.5, 0.2).stay(0.5)
    assert not press.tracker.in_contact
