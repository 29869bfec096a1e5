"""Modules of the page by themselves, in the browser that runs them."""

import json

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
