"""Tests of the texts of the force alarm on the web page, run in the browser."""

import json

import pytest

from tests.web.browser import NEEDS_CHROMIUM, NEEDS_PLAYWRIGHT

pytestmark = [NEEDS_CHROMIUM, NEEDS_PLAYWRIGHT]

ALARM = {"status": ["force_high_alarm"], "force_limit_n": 5.0, "force_n": 3.0, "force_uncompensated_n": 3.0}


@pytest.mark.parametrize(
    ("change", "bar", "title"),
    [
        ({"status": []}, "", ""),
        ({"force_n": 5.1}, "Force above 5.00 N. Back off.", "force above 5.00 N"),
        (
            {},  # the unfiltered pressure is ahead of the alarm
            "Force alarm: the balloon may have been pressed flat.",
            "force alarm: the balloon may have been pressed flat",
        ),
        (
            {
                "status": ["force_high_alarm", "out_of_range"],
                "force_n": None,
                "force_uncompensated_n": None,
            },
            "The balloon may be pressed flat: assume the highest force. Back off.",
            "balloon may be pressed flat",
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
    texts = page.evaluate(script % json.dumps(ALARM | change))
    assert (texts["bar"], texts["title"]) == (bar, title)
    assert "interpolated" not in change.get("status", []) or "Above" not in texts["figure"]


def test_after_the_force_alarm_the_page_states_that_the_force_was_high(page):
    script = """Promise.all([import("/static/off-delay.js"), import("/static/force-alarm.js")]).then(
      ([{ AlarmOffDelay }, { forceAlarmTexts }]) => {
        const delay = new AlarmOffDelay();
        return %s.map((state) => forceAlarmTexts(delay.apply(state)).bar);
      })"""
    rest = {"status": [], "force_n": 0.0, "force_uncompensated_n": 0.0}
    states = [
        {"t_s": 1.0, **ALARM, "force_n": 6.0},
        {"t_s": 1.2, **ALARM, **rest},
        {"t_s": 1.4, **ALARM, "status": ["force_high_alarm", "out_of_range"], "force_n": None},
        {"t_s": 1.6, **ALARM, **rest, "force_limit_n": 9.0},
    ]
    bars = page.evaluate(script % json.dumps(states))
    assert bars[1] == "Force alarm: was above 5.00 N."
    assert bars[3] == "Force alarm: the balloon may have been pressed flat."
