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
        ({"session": {"user": None, "hasUsers": False}}, "no_users"),
        ({"session": {"user": None, "hasUsers": True}}, "logged_out"),
        ({"session": {"user": None, "hasUsers": True, "isEnded": True}}, "login_ended"),
        ({"session": {"user": {"name": "bob", "role": "viewer", "may_write": False}}}, "no_right"),
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
      const model = { link: { up: true }, info: { map_version: 1 },
                      session: { user: { name: "anna", role: "operator", may_write: true } },
                      arming: { isVentDue: false } };
      return %s.map((change) =>
        blockedBy("hold", { ...model, ...change, state: { ...state, ...change } }));
    })"""
    results = page.evaluate(script % json.dumps([change for change, _ in cases]))
    for (change, code), blocked in zip(cases, results, strict=True):
        assert (blocked and blocked["code"]) == code, change
        assert blocked is None or blocked["text"].endswith(".")


def test_the_duration_of_a_contact_without_its_beginning_or_end_is_a_lower_limit(page):
    script = """import("/static/contacts.js").then(({ durationText }) => [
      durationText({ open: false, cut: false, interrupted: false, duration_s: 1.23 }, true),
      durationText({ open: false, cut: true, interrupted: false, duration_s: 1.23 }, true),
      durationText({ open: false, cut: false, interrupted: true, duration_s: 1.23 }, true),
      durationText({ open: true, cut: true, interrupted: false, duration_s: 1.23 }, true),
      durationText({ open: true, cut: false, interrupted: false, duration_s: 1.23 }, false),
    ])"""
    assert page.evaluate(script) == ["1.2", "> 1.2", "> 1.2", "in contact", "–"]


def test_the_reason_why_there_is_no_force(page):
    held, outside = {"state": "holding"}, {"status": ["out_of_range"], "setpoint_kpa": 3.0}
    cases = [
        ({"status": ["stale"]}, "no current samples"),
        ({"state": "tripped", "faults": [5]}, "tripped"),
        ({"state": "vented"}, "vented"),
        ({"state": "settling"}, "wait"),
        ({**held, "status": ["function_check"]}, "proof test"),
        ({**held, **outside}, "4.95 to 11.45 kPa"),
        ({**held, **outside, "setpoint_kpa": 8.0}, "model"),
        ({**held, "status": ["baseline_old"]}, "baseline"),
        (held, "invalid"),
    ]
    script = """import("/static/no-force.js").then(({ noForceReason }) =>
      %s.map((state) =>
        noForceReason({ status: [], faults: [], ...state }, { force_range_kpa: [4.95, 11.45] })))"""
    reasons = page.evaluate(script % json.dumps([state for state, _ in cases]))
    for (state, word), reason in zip(cases, reasons, strict=True):
        assert word in reason, state
        assert len(reason) <= 45, state


@pytest.mark.parametrize(
    ("change", "alarm", "title"),
    [
        ({}, "", "1.2 N · holding · pneuforce"),
        ({"status": ["interpolated", "in_contact"]}, "", "holding · in contact · pneuforce"),
        ({"status": ["force_high_alarm"], "force_n": 1.2}, "", "⚠ force above 0.50 N · pneuforce"),
        ({"maintenance_causes": ["tube_unproven"]}, "", "⚠ the tube was blocked · pneuforce"),
        ({"faults": [5], "state": "tripped"}, "", "⚠ burst · pneuforce"),
        ({"faults": [9]}, "NOT VENTED. Press the stop switch.", "⚠ NOT VENTED · pneuforce"),
        (None, "", "⚠ no values · pneuforce"),
    ],
)
def test_the_title_shows_the_most_important_alarm_or_the_force(page, change, alarm, title):
    state = {"state": "holding", "status": [], "faults": [], "force_n": 1.234, "force_limit_n": 0.5}
    state = None if change is None else {**state, **change}
    script = """import("/static/page-title.js").then(({ titleText }) =>
      titleText({ link: { reason: "" }, info: { faults: { 5: { title: "burst" } } }, state: %s }, "%s"))"""
    assert page.evaluate(script % (json.dumps(state), alarm)) == title


def test_after_a_blocked_tube_the_bar_warns_until_a_proof_test_has_passed(page):
    """Each case: causes of the required maintenance, latched faults, and the text of the bar."""
    warning = "Look at the balloon. Hold for 15 s."
    cases = [
        (["tube_unproven"], [], warning),
        (["tube_unproven"], [5], "Look at the balloon."),
        (["tube_unproven"], [5, 10], ""),
        (["leak"], [], ""),
        ([], [], ""),
    ]
    script = """import("/static/state-bar.js").then(({ tubeText }) =>
      %s.map(([maintenance_causes, faults]) =>
        tubeText({ maintenance: { tube_unproven: "%s" } }, { maintenance_causes, faults })))"""
    shown = page.evaluate(script % (json.dumps([case[:2] for case in cases]), warning))
    assert shown == [text for *_, text in cases]


def test_a_force_below_the_lower_limit_is_not_shown_as_a_measurement(page):
    """Each case: force, and its text in the table of contacts. The limit is 1.2 N."""
    cases = [
        (0.6, "< 1.20, touch only"),
        (1.2, "1.20 ± 0.20"),
        (-0.1, "< 1.20, touch only"),
    ]
    script = """Promise.all(
      ["contacts", "plot-values", "state-bar"].map((name) => import(`/static/${name}.js`)),
    ).then(([{ peakText }, { valueTexts }, { summaryText }]) => %s.map((force_n) => {
        const limits = { lower_limit_n: 1.2, force_lower_range_limit_n: 1.2 };
        const status = force_n < 1.2 ? ["interpolated"] : [];
        return [
          peakText({ peak_n: force_n, peak_std_n: 0.1, ...limits }),
          valueTexts({ t_s: 0, force_n, std_n: 0.1, in_contact: 1, ...limits }, 0, {})[1],
          summaryText({ force_n, status, pressure_kpa: 8, ...limits }),
        ];
      }))"""
    for (_, text), shown in zip(
        cases, page.evaluate(script % json.dumps([force_n for force_n, _ in cases])), strict=True
    ):
        number, *note = text.split(", ")
        pointer = f"{number} N, touch only" if note else f"{number} N (2 u)"
        assert shown == [text, pointer, f"{number.split(' ±')[0]} N   8.00 kPa"]


def test_forces_below_the_lower_limit_have_their_own_curve(page):
    """A neighbour of such a force is in both curves. Without a contact, a force of 0 is measured."""
    script = """import("/static/touch.js").then(({ splitForces }) =>
      splitForces([0, 0.5, 2, 2, null, 0.5], [1, 1, 1, 1, 1, null], [0, 1, 1, 1, 1, 1]))"""
    measured, touch = page.evaluate(script)
    assert measured == [0, None, 2, 2, None, 0.5]
    assert touch == [0, 0.5, 2, None, None, None]


def test_the_force_alarm_ends_one_second_after_the_last_state_with_this_alarm(page):
    """Each case: time of a state, whether it has the alarm, and whether the alarm is shown."""
    cases = [(10.0, 0, 0), (10.2, 1, 1), (10.4, 0, 1), (10.6, 1, 1), (11.5, 0, 1), (11.7, 0, 0), (2.0, 0, 0)]
    script = """import("/static/off-delay.js").then(({ AlarmOffDelay }) => {
      const delay = new AlarmOffDelay();
      return %s.map(([t_s, isHigh]) =>
        delay.apply({ t_s, status: isHigh ? ["force_high_alarm"] : [] }).status.length);
    })"""
    assert page.evaluate(script % json.dumps(cases)) == [shown for *_, shown in cases]


@pytest.mark.parametrize("ends", ["before the announcement", "after the announcement"])
def test_the_announcement_of_a_status_bit_is_removed_when_the_bit_ends(page, ends):
    """A screen reader must not find "failure" beside a valid force after one late sample."""
    script = """import("/static/announcements.js").then(async ({ Announcer }) => {
      const [polite, alarms] = [0, 1].map(() => document.createElement("p"));
      const announcer = new Announcer(polite, alarms, 60000);
      const update = (...status) =>
        announcer.update({ state: "holding", status, faults: [] }, { faults: {}, status: {} });
      const shown = async () => {
        while (!polite.textContent) await new Promise((done) => setTimeout(done, 10));
      };
      update("failure", "baseline_old");
      if (%s) await shown();
      update("baseline_old");
      await shown();
      return polite.textContent;
    })"""
    announced = page.evaluate(script % json.dumps(ends == "after the announcement"))
    assert "failure" not in announced
    assert "State: holding." in announced
    assert "baseline old" in announced


def test_announcements_are_removed_after_they_were_read(page):
    texts = page.evaluate(
        """import("/static/announcements.js").then(async ({ Announcer }) => {
          const [polite, alarms] = [0, 1].map(() => document.createElement("p"));
          const announcer = new Announcer(polite, alarms, 200);
          announcer.update({ state: "holding", status: [], faults: [] }, { faults: {}, status: {} });
          const wait = (ms) => new Promise((done) => setTimeout(done, ms));
          while (!polite.textContent) await wait(10);
          const before = polite.textContent;
          await wait(400);
          return [before, polite.textContent];
        })"""
    )
    assert texts == ["State: holding.", ""]


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


def test_older_samples_are_inserted_in_order_and_a_pause_is_a_gap_on_both_sides(page):
    before, filled = page.evaluate(
        """import("/static/series.js").then(({ Series }) => {
          const series = new Series(["force_n"]);
          series.push({ t_s: [1, 1.1], force_n: [1, 2] });
          series.push({ t_s: [9, 9.1], force_n: [5, 6] });
          const before = series.latest(Infinity);
          series.insert({ t_s: [8.2, 8.6], force_n: [3, 4] });
          series.insert({ t_s: [1.1, 1.5], force_n: [2, 3] });
          return [before, series.latest(Infinity)];
        })""",
    )
    assert before == [[1, 1.1, 8.999, 9, 9.1], [1, 2, None, 5, 6]]
    assert filled == [[1, 1.1, 1.5, 8.199, 8.2, 8.6, 9, 9.1], [1, 2, 3, None, 3, 4, 5, 6]]


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
    with urlopen(f"{live.url}api/live", timeout=60.0) as stream:
        events = takewhile(lambda _: time.monotonic() < until_s, read_events(stream))
        health = next((data for name, data in events if name == "health"), None)
    assert health is not None
    for section, names in counters.items():
        assert health[section] is None or set(names) <= set(health[section]), section


def test_a_size_is_shown_in_a_unit_that_suits_it(page):
    script = """import("/static/format.js").then(({ formatBytes }) =>
      [40_000, 1_234_567, 98_700_000, 2_345_000_000].map(formatBytes))"""
    assert page.evaluate(script) == ["40.0 kB", "1.23 MB", "98.7 MB", "2.35 GB"]


def test_the_elapsed_time_of_a_recording_is_readable(page):
    cases = [(0.7, "0.7 s"), (59.94, "59.9 s"), (59.96, "0:01:00"), (61, "0:01:01"), (36_005, "10:00:05")]
    script = """import("/static/format.js").then(({ formatElapsed }) => %s.map(formatElapsed))"""
    shown = page.evaluate(script % json.dumps([seconds for seconds, _ in cases]))
    assert shown == [text for _, text in cases]


def test_the_question_about_another_setpoint_warns_outside_the_range_of_the_force(page):
    script = (
        """import("/static/questions.js").then(({ moveQuestion }) => moveQuestion(4, "No force.").text)"""
    )
    assert page.evaluate(script) == (
        "The pressure will move to 4.00 kPa as soon as nothing touches the balloon. No force."
    )


def test_a_saved_contact_without_a_force_has_a_note(page):
    script = """import("/static/samples-csv.js").then(({ samplesAsCsv }) => {
      const names = ["pressure_kpa", "baseline_kpa", "force_n", "std_n", "in_contact", "board_state",
                     "lower_limit_n"];
      const samples = [[0, 1, 2], [13, 8, 12], [8, 8, 8], [null, 0, 2.9], [null, 0.1, 0.5], [1, 0, 1],
                       [4, 4, 4], [1.2, 1.2, 1.2]];
      return samplesAsCsv(samples, names, { min: 0, max: 2 }, 0).text;
    })"""
    notes = [line.split(",")[-1] for line in page.evaluate(script).splitlines()]
    assert notes == ["force_note", "no force", "", ""]
