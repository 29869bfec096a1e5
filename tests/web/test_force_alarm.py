"""Tests of the texts of the force alarm on the web page, run in the browser."""

import json

import pytest

from pneuforce.instrument.core.state import ALARM_RISE_KPA
from tests.web.browser import NEEDS_CHROMIUM, NEEDS_PLAYWRIGHT

pytestmark = [NEEDS_CHROMIUM, NEEDS_PLAYWRIGHT]

ALARM = {"status": ["force_high_alarm"], "force_limit_n": 5.0, "force_n": 3.0, "force_uncompensated_n": 3.0}


@pytest.mark.parametrize(
    ("change", "bar", "title"),
    [
        ({"status": []}, "", ""),
        ({"force_n": 5.1}, "Force above 5.00 N. Back off.", "force above 5.00 N"),
        (
            {"rise_kpa": 6.08},
            "Pressure rise above 6 kPa: the force may be higher than shown. Back off.",
            "pressure rise above 6 kPa",
        ),
        (
            {"rise_kpa": 6.08, "force_n": None, "force_uncompensated_n": None},
            "Pressure rise above 6 kPa: assume the highest force. Back off.",
            "pressure rise above 6 kPa",
        ),
        (
            {"force_uncompensated_n": 5.2},  # the force falls, and the lag compensation is ahead of the alarm
            "Force alarm: was above 5.00 N.",
            "force alarm: was above 5.00 N",
        ),
        (  # the limit is below the lower limit of measurement
            {"status": ["force_high_alarm", "interpolated"], "force_n": 0.6, "force_limit_n": 0.5},
            "Force alarm, limit 0.50 N. Back off.",
            "force alarm",
        ),
    ],
)
def test_the_force_alarm_names_its_cause(page, change, bar, title):
    script = """import("/static/force-alarm.js").then(({ forceAlarmTexts }) => forceAlarmTexts(%s))"""
    texts = page.evaluate(script % json.dumps(ALARM | {"rise_kpa": 3.0} | change))
    assert (texts["bar"], texts["title"]) == (bar, title)
    assert "interpolated" not in change.get("status", []) or "Above" not in texts["figure"]


def test_the_page_and_the_instrument_use_the_same_pressure_rise_for_the_alarm(page):
    script = """import("/static/force-alarm.js").then(({ ALARM_RISE_KPA }) => ALARM_RISE_KPA)"""
    assert page.evaluate(script) == ALARM_RISE_KPA


def test_after_the_force_alarm_the_page_states_that_the_force_was_high(page):
    script = """Promise.all([import("/static/off-delay.js"), import("/static/force-alarm.js")]).then(
      ([{ AlarmOffDelay }, { forceAlarmTexts }]) => {
        const delay = new AlarmOffDelay();
        return %s.map((state) => forceAlarmTexts(delay.apply(state)).bar);
      })"""
    rest = {"status": [], "force_n": 0.0, "force_uncompensated_n": 0.0, "rise_kpa": 0.0}
    states = [
        {"t_s": 1.0, **ALARM, "force_n": 6.0, "rise_kpa": 3.0},
        {"t_s": 1.2, **ALARM, **rest},
        {"t_s": 1.4, **ALARM, "rise_kpa": 6.1},
        {"t_s": 1.6, **ALARM, **rest, "force_limit_n": 9.0},
    ]
    bars = page.evaluate(script % json.dumps(states))
    assert bars[1] == "Force alarm: was above 5.00 N."
    assert bars[3] == "Force alarm: pressure rise was above 6 kPa."
