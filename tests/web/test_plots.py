"""Tests of the plots in a real browser: scales, values at the pointer, pause, zoom and download."""

import base64
import csv
import json
import re
import time
from datetime import datetime

import pytest

from pneuforce.instrument.stream.sample_record import SampleRecord
from pneuforce.protocol.frames import BoardState
from tests.web.browser import NEEDS_CHROMIUM, NEEDS_PLAYWRIGHT
from tests.web.conftest import DESKTOP

pytestmark = [NEEDS_CHROMIUM, NEEDS_PLAYWRIGHT]

#: Draw a batch of samples in plots of their own. Return the part of the height that the force curve fills.
HEIGHT_OF_CURVE = """import("/static/plots.js").then(async ({ Plots }) => {
  const boxes = [0, 1].map(() => {
    const box = document.createElement("div");
    box.className = "plot";
    document.querySelector("#main").append(box);
    return box;
  });
  const plots = new Plots(...boxes);
  plots.addSamples(%s);
  const drawn = () => new Promise((done) => setTimeout(() => requestAnimationFrame(done), 100));
  await drawn();
  await drawn();
  const canvas = boxes[0].querySelector("canvas");
  const [r, g, b] = getComputedStyle(document.querySelector(".force-key")).color.match(/\\d+/g).map(Number);
  const { data, width, height } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  const rows = [];
  for (let at = 0; at < data.length; at += 4)
    if (data[at] === r && data[at + 1] === g && data[at + 2] === b) rows.push(Math.floor(at / 4 / width));
  boxes.forEach((box) => box.remove());
  return (rows.at(-1) - rows[0]) / height;
})"""


def batch(force_n, std_n):
    """Return samples of 10 s at 100 per second, with the force and its uncertainty as functions of time."""
    times = [i / 100 for i in range(1000)]
    return {
        "t_s": times,
        "force_n": [force_n(t) for t in times],
        "std_n": [std_n(t) for t in times],
        "lower_limit_n": [1.2] * 1000,
        "pressure_kpa": [8.0] * 1000,
        "baseline_kpa": [8.0] * 1000,
        "in_contact": [0] * 1000,
        "board_state": [4] * 1000,
    }


@pytest.mark.parametrize("burst_u_n", [0.1, 5.0, 500.0])
def test_a_moment_of_high_uncertainty_does_not_flatten_the_force_curve(page, burst_u_n):
    """A burst balloon has a force near 0 with an uncertainty of several newtons."""
    samples = batch(lambda t: 2.0 if 2 < t < 4 else 0.0, lambda t: burst_u_n if 8 < t < 8.2 else 0.05)
    assert page.evaluate(HEIGHT_OF_CURVE % json.dumps(samples)) > 0.35


def test_an_operator_sets_the_alarm_limit(page, live):
    page("fill", on="#limit-input", text="25")
    page("press", key="Enter")
    page.wait_for_text("#limit-error", "0.1 to 20 N")
    page("fill", on="#limit-input", text="1,5")
    page("press", key="Enter")
    page.wait_for_text("#result[data-code=limit_accepted]", "1.50 N")
    page.wait_for_text("#limit-in-effect", "1.50 N")
    assert live.rig.read()["force_limit"] == 1.5
    live.rig.write("force_limit", 5.0)
    page.wait_for_text("#limit-in-effect", "5.00 N")


FORCE_PLOT = "#force-plot .u-over"
VALUES = re.compile(
    r"(\d\d:\d\d:\d\d\.\d\d)\s+(?:(\S+) ± (\S+) N \(2 u\)|< \S+ N, touch only|no force)\s+(\S+) kPa\s+(.+)"
)


def values_at_pointer(page):
    """Return the texts at the pointer: time, force, 2 u, pressure, state; None while there is no value.

    Below the lower limit of the force, the texts of the force and of 2 u are None.
    """
    found = VALUES.match(page.text("#plot-values"))
    return found and found.groups()


@pytest.fixture
def paused(browser, live, resumed_at_the_end):
    """Return a page whose plots are paused and contain a press of 2 N. Tests share one press."""
    page = browser
    page("resize", **DESKTOP)
    if page.data("#plots-pause", "paused") != "true":
        live.recover()
        page("click", on="label:has([value='10'])")
        live.rig.inflate(8.0)
        live.rig.press(2.0)
        page.wait_for_text("#state", "in contact")
        live.lower_limit_n = live.rig.read()["force_lower_range_limit"]
        live.rig.release()
        page.wait_for_text("#contacts tr td:last-child", ".")
        page("click", on="#plots-pause")
    yield page
    if not page.is_hidden("#plots-unzoom"):
        page("click", on="#plots-unzoom")


@pytest.fixture(scope="module")
def resumed_at_the_end(browser):
    """End a pause after the last test of this module."""
    yield
    if browser.data("#plots-pause", "paused") == "true":
        browser("click", on="#plots-pause")


def test_the_values_at_the_pointer(paused):
    found = []
    for across in range(2, 100, 4):
        paused("point", on=FORCE_PLOT, at=[across / 100, 0.5])
        found.append(values_at_pointer(paused))
    found = [each for each in found if each]
    assert len(found) > 10
    in_contact = [float(force) for _, force, _, _, state in found if force and state == "holding, in contact"]
    assert max(in_contact) == pytest.approx(2.0, rel=0.2)
    held = [float(pressure) for *_, pressure, state in found if state == "holding"]
    assert held[-1] == pytest.approx(8.0, abs=0.2)
    assert [clock for clock, *_ in found] == sorted(clock for clock, *_ in found)
    paused("point", on="#plots-title", at=[0.5, 0.5])
    assert values_at_pointer(paused) is None


def test_a_touch_shows_values_and_two_fingers_zoom(paused):
    paused("touch", on=FORCE_PLOT, steps=[[[0.95, 0.5]]])
    assert values_at_pointer(paused)
    paused("touch", on=FORCE_PLOT, steps=[[[0.6, 0.5], [0.8, 0.5]], [[0.5, 0.5], [0.9, 0.5]]])
    paused.wait_for_visible("#plots-unzoom")


def step_to_a_value(page, key):
    """Press a key until the pointer is at a sample, and return the values.

    At the right edge and on a busy computer, some positions are further than 0.1 s from the next sample.
    """
    for _ in range(20):
        page("press", key=key)
        if found := values_at_pointer(page):
            return found
    raise AssertionError(f"no value after 20 presses of {key}: {page.text('#plot-values')!r}")


def test_arrow_keys_move_through_the_samples(paused):
    paused.evaluate("document.querySelector('#force-plot').focus()")
    later, *_ = step_to_a_value(paused, "ArrowLeft")
    earlier, *_ = step_to_a_value(paused, "Shift+ArrowLeft")
    assert earlier < later
    assert step_to_a_value(paused, "ArrowRight")[0] > earlier


def test_screen_readers_read_the_values_only_after_a_key(page):
    script = """(() => {
      const key = new KeyboardEvent("keydown", { key: "ArrowLeft", bubbles: true });
      document.querySelector("#force-plot").dispatchEvent(key);
      return document.querySelector("#plot-values").ariaLive;
    })()"""
    assert page.evaluate(script) == "polite"
    page.wait("document.querySelector('#plot-values').ariaLive === 'off'")


def shown_times(page):
    """Download the shown samples and return their times of day."""
    return [row["utc"] for row in download(page)[1]]


def download(page):
    file = page("download", on="#plots-save")
    return file["name"], list(csv.DictReader(base64.b64decode(file["base64"]).decode().splitlines()))


def test_the_shown_samples_are_saved_with_the_columns_of_an_export(paused):
    name, rows = download(paused)
    assert re.fullmatch(r"pneuforce-\d{8}T\d{6}Z\.csv", name)
    assert set(rows[0]) - set(SampleRecord._fields) == {"utc", "force_note"}
    assert next(iter(rows[0])) == "t_s"
    assert float(rows[0]["t_s"]) == 0.0
    age_s = time.time() - datetime.fromisoformat(rows[-1]["utc"]).timestamp()
    assert -0.5 < age_s < 60.0
    pressures = [float(row["pressure_kpa"]) for row in rows if row["pressure_kpa"]]
    final_kpa = float(paused.text("#contacts tr").split("\t")[5])
    assert max(pressures) == pytest.approx(final_kpa, abs=0.3)
    assert {int(row["state"]) for row in rows} >= {BoardState.HOLDING.value}
    assert max(float(row["force_n"]) for row in rows if row["in_contact"] == "1" and row["force_n"]) > 1.5


def test_saved_forces_below_the_lower_limit_are_marked(paused, live):
    """A press of 2 N begins and ends with forces below the limit."""
    limit_n = live.lower_limit_n
    rows = [row for row in download(paused)[1] if row["in_contact"] == "1" and row["force_n"]]
    notes = {row["force_note"] for row in rows} - {""}
    limits_n = [float(re.fullmatch(r"touch only: < (\d\.\d\d) N", note)[1]) for note in notes]
    assert limits_n == pytest.approx([limit_n] * len(limits_n), abs=0.02)  # it follows the pressure
    assert limits_n
    for row in rows:
        if abs(float(row["force_n"]) - limit_n) > 0.03:
            assert bool(row["force_note"]) == (float(row["force_n"]) < limit_n), row


def test_paused_plots_stop_while_data_is_collected_and_a_zoom_can_be_undone(paused):
    assert paused.text("#plots-paused").startswith("PAUSED")
    before = shown_times(paused)
    paused("drag", on=FORCE_PLOT, **{"from": [0.8, 0.5], "to": [0.9, 0.5]})
    paused.wait_for_visible("#plots-unzoom")
    zoomed = shown_times(paused)
    assert before[0] < zoomed[0] < zoomed[-1] < before[-1]
    paused("doubleClick", on=FORCE_PLOT)
    paused.wait_for_hidden("#plots-unzoom")
    assert shown_times(paused) == before
    paused("click", on="label:has([value='60'])")
    paused("click", on="#plots-pause")
    paused.wait_for_hidden("#plots-paused")
    now = shown_times(paused)
    assert now[-1] > before[-1]
    assert set(before) <= set(now)
