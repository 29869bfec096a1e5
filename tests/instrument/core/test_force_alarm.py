"""Tests of the second force alarm: limit, hysteresis and delay."""

import math

import pytest

from pneuforce.instrument.core.force_alarm import ForceAlarm
from pneuforce.protocol.frames import BoardState
from tests.instrument.instrument_harness import HOLD_8, VENT, InstrumentHarness

LIMIT_2 = {"force_limit_2_n": 0.5, "alarm_hysteresis_n": 0.1, "alarm_delay_s": 0.0}


def course(forces_n, held=True, **settings):
    """Return whether the alarm is active after each force. The samples are 1 s apart."""
    alarm, active = ForceAlarm(), []
    settings = {"limit_n": 2.0, "hysteresis_n": 0.5, "delay_s": 0.0} | settings
    for t_s, force_n in enumerate(forces_n):
        alarm.step(float(t_s), force_n, held=held, **settings)
        active.append(alarm.active)
    return active


def test_the_alarm_begins_above_the_limit_and_ends_at_the_limit_minus_the_hysteresis():
    assert course([1.9, 2.0, 2.1, 1.9, 1.6, 1.5, 1.9]) == [False, False, True, True, True, False, False]


def test_without_hysteresis_the_alarm_follows_the_limit():
    assert course([2.1, 2.0, 2.1], hysteresis_n=0.0) == [True, False, True]


def test_the_alarm_ends_without_force_even_if_the_hysteresis_is_above_the_limit():
    assert course([2.1, 0.1, 0.0], hysteresis_n=5.0) == [True, True, False]


def test_the_force_must_be_above_the_limit_for_the_delay():
    assert course([2.1, 2.1, 1.9, 2.1, 2.1, 2.1], delay_s=2.0) == [False] * 5 + [True]


def test_a_missing_force_neither_ends_the_alarm_nor_restarts_its_delay():
    assert course([2.1, math.nan, math.nan, 1.5]) == [True, True, True, False]
    assert course([2.1, math.nan, 2.1], delay_s=2.0) == [False, False, True]


def test_a_missing_force_alone_is_no_alarm():
    assert course([math.nan] * 3) == [False] * 3


def test_a_balloon_that_is_not_held_has_no_alarm():
    alarm = ForceAlarm(active=True)
    alarm.step(0.0, math.nan, held=False, limit_n=2.0, hysteresis_n=0.5, delay_s=0.0)
    assert not alarm.active


@pytest.mark.parametrize("first_limit_n", [0.1, 20.0])
def test_the_second_alarm_does_not_depend_on_the_first(first_limit_n):
    harness = InstrumentHarness.holding()
    harness.write_ok(LIMIT_2 | {"force_limit_n": first_limit_n})
    harness.push_kpa = 1.0
    harness.run(0.6)
    status = harness.snapshot().status
    assert "force_high_alarm_2" in status
    assert ("force_high_alarm" in status) is (first_limit_n < 1)


@pytest.mark.parametrize(("push_kpa", "flat"), [(4.5, False), (4.8, True)])
def test_a_balloon_that_may_be_pressed_flat_has_no_force_and_sets_both_alarms(push_kpa, flat):
    harness = InstrumentHarness.holding()
    harness.write_ok({"force_limit_n": 10.0, "force_limit_2_n": 10.0, "alarm_delay_s": 0.0})
    harness.push_kpa = push_kpa
    harness.run(1.0)
    shown = harness.snapshot()
    assert ("force_valid" not in shown.status, math.isnan(shown.force_n)) == (flat, flat)
    for name in ("out_of_range", "force_high_alarm", "force_high_alarm_2"):
        assert (name in shown.status) is flat


def test_the_delay_is_the_time_of_the_samples():
    harness = InstrumentHarness.holding()
    harness.write_ok(LIMIT_2 | {"force_limit_n": 0.5, "alarm_delay_s": 0.25})
    harness.push_kpa = 1.0
    harness.run(1.0, lambda: "force_high_alarm" in harness.snapshot().status)
    begun_s = harness.now_s
    harness.run(1.0, lambda: "force_high_alarm_2" in harness.snapshot().status)
    assert harness.now_s - begun_s == pytest.approx(0.25, abs=0.003)


def alarmed():
    harness = InstrumentHarness.holding()
    harness.write_ok(LIMIT_2)
    harness.push_kpa = 1.0
    return harness.run(0.6)


@pytest.mark.parametrize("sample", [{"adc_sum": 0}, {"state": BoardState.TESTING}])
def test_the_alarm_stays_while_a_held_balloon_has_no_force(sample):
    harness = alarmed()
    assert math.isnan(harness.feed(**sample).force_n)
    assert "force_high_alarm_2" in harness.snapshot().status


def test_the_alarm_stays_while_no_samples_arrive():
    harness = alarmed()
    harness.now_s += 0.2
    assert {"stale", "force_high_alarm_2"} <= harness.snapshot().status


def test_the_alarm_ends_with_the_trip_of_a_lost_link():
    harness = alarmed().run_without_samples(0.3)
    seen = harness.snapshot()
    assert seen.state == "tripped"
    assert not seen.status & {"force_high_alarm_2", "interpolated"}


def test_the_alarm_ends_with_a_vent():
    harness = alarmed()
    harness.write_ok(VENT)
    harness.run(0.1)
    assert "force_high_alarm_2" not in harness.snapshot().status


def test_the_second_limit_does_not_vent():
    harness = InstrumentHarness.holding(vent_on_force_limit=True)
    harness.write_ok(LIMIT_2 | HOLD_8)
    harness.push_kpa = 1.0
    harness.run(0.6)
    assert harness.commands_hold


def test_the_limits_after_a_start_are_those_of_the_settings():
    seen = InstrumentHarness.new(force_limit_2_n=3.0, alarm_hysteresis_n=0.3, alarm_delay_s=0.5).snapshot()
    assert (seen.force_limit_2_n, seen.alarm_hysteresis_n, seen.alarm_delay_s) == (3.0, 0.3, 0.5)
