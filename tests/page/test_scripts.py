"""Modules of the page by themselves, in the browser that runs them."""

import json

import pytest

from tests.page.browser import NEEDS_CHROMIUM, NEEDS_PLAYWRIGHT

pytestmark = [NEEDS_CHROMIUM, NEEDS_PLAYWRIGHT]


def test_why_not_to_inflate_is_known_beforehand(page):
    """Each case changes one thing of a world in which hold may be asked for."""
    cases = [
        ({}, ""),
        ({"link": {"up": False}}, "Not connected"),
        ({"about": {}}, "not known yet"),
        ({"about": {"writable": False}}, "No operator’s token"),
        ({"token": {"value": ""}}, "Log in"),
        ({"token": {"value": "", "stale": True}}, "log in again"),
        ({"lease_holder": "can"}, "(can)"),
        ({"status": ["vented", "write_lock"]}, "locks writes"),
        ({"faults": [4]}, "clear the faults"),
        ({"arming": {"isVentDue": True}}, "a vent from here"),
        ({"mode": "hold"}, "Vent first"),
        ({"setpoint_requested_kpa": None}, "Set a setpoint"),
        ({"state": "venting"}, "Vent first"),
        ({"status": ["vented", "not_zeroed"]}, "no zero"),
    ]
    script = """import("/static/permissions.js").then(({ whyNot }) => {
      const state = { lease_holder: "none", status: ["vented"], faults: [], mode: "vent", state: "vented",
                      setpoint_requested_kpa: 8 };
      const world = { link: { up: true }, about: { writable: true }, token: { value: "t" },
                      arming: { isVentDue: false } };
      return %s.map((change) => whyNot("hold", { ...world, ...change, state: { ...state, ...change } }));
    })"""
    whys = page("evaluate", script=script % json.dumps([change for change, _ in cases]))
    for (change, told), why in zip(cases, whys, strict=True):
        assert told in why, (change, why)
        assert bool(told) == bool(why), (change, why)


def test_what_comes_late_is_told_by_its_delay_and_not_by_the_clocks(page):
    """For [s]: when it is said, when it comes, by clocks of which one runs faster by 100 in a million."""
    cases = [
        (1000, 5, 0),
        (1001, 6.01, 0.01),
        (1002, 12, 5),  # the line has become slow
        (1003, 13, 5),
        (1004, 9.004, 0),
        (11004, 10010.004, 0),  # three hours later: no second of delay by the clocks alone
        (11005, 10021, 9),
    ]
    script = """import("/static/age.js").then(({ Age }) => {
      const age = new Age();
      age.begin(1);
      const ages = %s.map(([said, comes]) => (age.begin(1), age.of(said, comes)));
      age.begin(2);
      return [...ages, age.of(3, 700)];
    })"""
    ages = page("evaluate", script=script % json.dumps(cases))
    assert ages == pytest.approx([*(delay for *_, delay in cases), 0], abs=1.1)
    assert all(age < 0.1 for age, (*_, delay) in zip(ages, cases, strict=False) if delay < 0.1)


def test_the_past_takes_its_place_and_fills_the_gap_of_a_lost_line(page):
    columns = page(
        "evaluate",
        script="""import("/static/series.js").then(({ Series }) => {
          const series = new Series(["force_n"]);
          series.push({ t_s: [1, 1.1], force_n: [1, 2] });
          series.push({ t_s: [9, 9.1], force_n: [5, 6] });
          series.insert({ t_s: [6, 8.95], force_n: [3, 4] });
          series.insert({ t_s: [1.1, 5.9], force_n: [2, 3] });
          return series.latest(Infinity);
        })""",
    )
    assert columns == [[1, 1.1, 5.9, 6, 8.95, 8.999, 9, 9.1], [1, 2, 3, 3, 4, None, 5, 6]]


def test_of_hours_of_samples_a_minute_is_kept(page):
    kept = page(
        "evaluate",
        script="""import("/static/series.js").then(({ Series, KEPT_S }) => {
          const series = new Series(["force_n"]);
          let most = 0;
          for (let t_s = 0; t_s < 7200; t_s += 0.5) {
            series.push({ t_s: [t_s + 0.1, t_s + 0.4], force_n: [t_s, null] });
            most = Math.max(most, series.latest(Infinity)[0].length);
          }
          const [times, forces] = series.latest(10);
          return [most, KEPT_S, times.length, forces.at(-2)];
        })""",
    )
    assert kept[0] <= 2 * kept[1] * 4 + 10
    assert kept[2:] == [42, 7199.5]  # 10 s, the one before them, and the last
