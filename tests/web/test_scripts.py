"""Tests of single JavaScript modules of the web page, run in the browser."""

import json
import time
from itertools import takewhile
from urllib.request import urlopen

import pytest

from tests.web.browser import NEEDS_CHROMIUM, NEEDS_PLAYWRIGHT
from tests.web.serving import read_events

pytestmark = [NEEDS_CHROMIUM, NEEDS_PLAYWRIGHT]


def test_the_reason_why_a_hold_is_blocked(page):
    """Each case changes one value of a model in which a hold is possible."""
    cases = [
        ({}, None),
        ({"link": {"up": False}}, "disconnected"),
        ({"info": {}}, "loading"),
        ({"info": {"writable": False}}, "no_token_configured"),
        ({"token": {"value": ""}}, "logged_out"),
        ({"token": {"value": "", "isExpired": True}}, "token_expired"),
        ({"lease_holder": "can"}, "lease"),
        ({"lease_holder": "web"}, None),
        ({"status": ["vented", "write_protect"]}, "write_protect"),
        ({"faults": [4]}, "tripped"),
        ({"arming": {"isVentDue": True}}, "vent_due"),
        ({"mode": "hold"}, "holding"),
        ({"setpoint_requested_kpa": None}, "no_setpoint"),
        ({"state": "venting"}, "not_vented"),
        ({"status": ["vented", "not_zeroed"]}, "not_zeroed"),
    ]
    script = """import("/static/permissions.js").then(({ blockedBy }) => {
      const state = { lease_holder: "none", status: ["vented"], faults: [], mode: "vent", state: "vented",
                      setpoint_requested_kpa: 8 };
      const model = { link: { up: true }, info: { writable: true }, token: { value: "t" },
                      arming: { isVentDue: false } };
      return %s.map((change) =>
        blockedBy("hold", { ...model, ...change, state: { ...state, ...change } }));
    })"""
    results = page.evaluate(script % json.dumps([change for change, _ in cases]))
    for (change, code), blocked in zip(cases, results, strict=True):
        assert (blocked and blocked["code"]) == code, change
        assert blocked is None or blocked["text"].endswith(".")


def test_the_age_of_data_is_estimated_without_synchronized_clocks(page):
    """Each case: time sent, time received, and delay [s]. One clock is faster by 100 ppm."""
    cases = [
        (1000, 5, 0),
        (1001, 6.01, 0.01),
        (1002, 12, 5),  # the network has become slow
        (1003, 13, 5),
        (1004, 9.004, 0),
        (11004, 10010.004, 0),  # three hours later, the drift of the clocks is not shown as a delay
        (11005, 10021, 9),
    ]
    script = """import("/static/age.js").then(({ AgeEstimator }) => {
      const estimator = new AgeEstimator();
      estimator.start(1);
      const ages = %s.map(([sent, received]) => (estimator.start(1), estimator.age(sent, received)));
      estimator.start(2);
      return [...ages, estimator.age(3, 700)];
    })"""
    ages = page.evaluate(script % json.dumps(cases))
    assert ages == pytest.approx([*(delay for *_, delay in cases), 0], abs=1.1)
    assert all(age < 0.1 for age, (*_, delay) in zip(ages, cases, strict=False) if delay < 0.1)


def test_older_samples_are_inserted_in_order_and_fill_a_gap(page):
    columns = page.evaluate(
        """import("/static/series.js").then(({ Series }) => {
          const series = new Series(["force_n"]);
          series.push({ t_s: [1, 1.1], force_n: [1, 2] });
          series.push({ t_s: [9, 9.1], force_n: [5, 6] });
          series.insert({ t_s: [6, 8.95], force_n: [3, 4] });
          series.insert({ t_s: [1.1, 5.9], force_n: [2, 3] });
          return series.latest(Infinity);
        })""",
    )
    assert columns == [[1, 1.1, 5.9, 6, 8.95, 8.999, 9, 9.1], [1, 2, 3, 3, 4, None, 5, 6]]


def test_only_the_last_minute_of_samples_is_kept(page):
    longest, keep_s, count, last_force = page.evaluate(
        """import("/static/series.js").then(({ Series, KEEP_S }) => {
          const series = new Series(["force_n"]);
          let longest = 0;
          for (let t_s = 0; t_s < 7200; t_s += 0.5) {
            series.push({ t_s: [t_s + 0.1, t_s + 0.4], force_n: [t_s, null] });
            longest = Math.max(longest, series.latest(Infinity)[0].length);
          }
          const [times, forces] = series.latest(10);
          return [longest, KEEP_S, times.length, forces.at(-2)];
        })""",
    )
    assert longest <= 2 * keep_s * 4 + 10
    assert (count, last_force) == (42, 7199.5)  # 41 values in the last 10 s, and one value before


def test_the_health_cards_use_counters_that_exist(page, live):
    """A counter that was renamed would silently disappear from the page."""
    counters = page.evaluate("""import("/static/health.js").then(({ COUNTERS }) => COUNTERS)""")
    until_s = time.monotonic() + 10.0
    with urlopen(f"{live.url}api/live", timeout=10.0) as stream:
        events = takewhile(lambda _: time.monotonic() < until_s, read_events(stream))
        health = next((data for name, data in events if name == "health"), None)
    assert health is not None
    for section, names in counters.items():
        assert health[section] is None or set(names) <= set(health[section]), section
