"""Tests of the compact view in a real browser: size and places of the digits, alarms, and VENT."""

import json
import math

import pytest

from tests.system.waiting import wait_for
from tests.web.browser import NEEDS_CHROMIUM, NEEDS_PLAYWRIGHT
from tests.web.test_state_bar import (
    BURST,
    FORCE_ALARM_AND_UNPROVEN_TUBE,
    NOT_IN_VIEW_NOW,
    SIZES,
    VENT_SHUT,
    not_in_view,
)
from tests.web.users import OPERATOR, PASSWORD

pytestmark = [NEEDS_CHROMIUM, NEEDS_PLAYWRIGHT]

LANDSCAPE = {"width": 844, "height": 330}  #: a phone of 844 x 390 pixels, without the bar of its browser
DIGIT_HEIGHT = 0.73  #: height of a digit, as a part of the font size
#: Height of a digit that is seen under 16 arc minutes from 3 m (minimum of ISO 9241-303); a pixel has 0.2 mm
MIN_DIGIT_PX = 3000 * math.radians(16 / 60) / 0.2
FONT_SIZE_PX = "parseFloat(getComputedStyle(document.querySelector('%s')).fontSize)"


def test_the_compact_view_shows_the_force_and_vents_without_a_login(shown, browser):
    """A phone is too small for digits that can be read from 3 m."""
    shown.set(force_n=-12.34, force_std_n=0.05, status=["holding", "in_contact", "simulated"])
    shown.open("?view=compact")
    browser.wait_for_text("#force", "12.34")
    assert "0.10" in browser.text("#force .unit")
    assert not browser.evaluate("document.querySelector('#controls').checkVisibility()")
    for name, size in SIZES.items():
        browser("resize", **size)
        missing = not_in_view(browser, "#vent-button", "#bar-state", "#force .number", "#force .unit")
        assert (name, missing) == (name, [])
        digit_px = browser.evaluate(FONT_SIZE_PX % "#force .number") * DIGIT_HEIGHT
        assert name == "phone" or digit_px >= MIN_DIGIT_PX, name
    browser("click", on="#vent-button")  # fails if VENT moves under the pointer
    wait_for(lambda: shown.requests, lambda requests: requests == [{"mode": "vent"}])
    shown.set(state="tripped", faults=[VENT_SHUT], status=["vent_fault", "failure"], force_n=None)
    browser.wait_for_visible("#vent-failed")
    for name, size in SIZES.items():
        browser("resize", **size)
        missing = not_in_view(browser, "#vent-button", "#bar-state", "#bar-fault", "#vent-failed")
        assert (name, missing) == (name, [])
        assert browser.evaluate("document.documentElement.scrollHeight - innerHeight") <= 0, name


def test_the_compact_view_shows_a_fault_with_its_remedy(shown, browser):
    shown.set(state="tripped", faults=[BURST], status=["burst", "failure"], force_n=None)
    shown.open("?view=compact")
    browser.wait_for_text("#bar-fault-action", "Check the balloon, the joint and the vent valve.")
    for name, size in (SIZES | {"landscape": LANDSCAPE}).items():
        browser("resize", **size)
        missing = not_in_view(browser, "#vent-button", "#bar-state", "#bar-fault-action")
        assert (name, missing) == (name, [])
        assert browser.evaluate("document.documentElement.scrollHeight - innerHeight") <= 0, name


def test_the_compact_view_shows_two_alarms_and_the_force_without_scrolling(shown, browser):
    shown.set(**FORCE_ALARM_AND_UNPROVEN_TUBE)
    shown.open("?view=compact")
    browser.wait_for_visible("#force-limit")
    for name, size in (SIZES | {"landscape": LANDSCAPE}).items():
        browser("resize", **size)
        missing = not_in_view(browser, "#vent-button", "#force-limit", "#tube-unproven", "#force .number")
        assert (name, missing) == (name, [])
        assert browser.evaluate("document.documentElement.scrollHeight - innerHeight") <= 0, name


#: Position of the last digit of the force and of its uncertainty.
DIGITS_PX = """(() => {
  const edge = (selector, side) => document.querySelector(selector).getBoundingClientRect()[side];
  const range = document.createRange();
  range.selectNodeContents(document.querySelector("#force .number"));
  return [range.getBoundingClientRect().right, edge("#force .unit", "left")].map(Math.round);
})()"""


def test_the_digits_of_the_compact_view_do_not_move(shown, browser):
    shown.set()
    shown.open("?view=compact")
    browser.wait_for_hidden("#force-limit")
    for size in SIZES.values():
        browser("resize", **size)
        positions = set()
        for force_n, text in ((0.5, "0.50"), (-0.5, "−0.50"), (12.34, "12.34")):
            shown.set(force_n=force_n, force_std_n=0.05, status=["holding", "in_contact"])
            browser.wait(f"document.querySelector('#force .number').textContent === '{text}'")
            positions.add(tuple(browser.evaluate(DIGITS_PX)))
        assert len(positions) == 1


#: Edges of the texts of the force: the number, and its uncertainty with the unit.
TEXT_EDGES_PX = """["number", "unit"].map((name) => {
  const range = document.createRange();
  range.selectNodeContents(document.querySelector(`#force .${name}`));
  const { left, right, top, bottom } = range.getBoundingClientRect();
  return { left, right, top, bottom };
})"""


def test_the_compact_view_has_the_uncertainty_below_the_force_at_the_same_edge(shown, browser):
    shown.set(force_n=12.34, force_std_n=1.05, status=["holding", "in_contact"])
    shown.open("?view=compact")
    browser.wait_for_text("#force", "12.34")
    for name, size in SIZES.items():
        browser("resize", **size)
        number, unit = browser.evaluate(TEXT_EDGES_PX)
        assert unit["top"] > (number["top"] + number["bottom"]) / 2, name
        assert unit["right"] == pytest.approx(number["right"], abs=0.01 * size["width"]), name
        assert 0 <= unit["left"] <= unit["right"] <= size["width"], name


def test_without_a_force_the_compact_view_has_a_dash_in_the_middle_and_no_unit(shown, browser):
    shown.set(state="vented", status=["vented"], force_n=None, force_std_n=None)
    shown.open("?view=compact")
    browser.wait_for_text("#force-missing", "inflate to measure")
    for name, size in (SIZES | {"landscape": LANDSCAPE}).items():
        browser("resize", **size)
        number, unit = browser.evaluate(TEXT_EDGES_PX)
        assert unit["right"] == 0, name  # not shown
        middle_px = (number["left"] + number["right"]) / 2
        assert middle_px == pytest.approx(size["width"] / 2, abs=0.02 * size["width"]), name


@pytest.mark.parametrize("touch", [False, True], ids=["mouse", "touch"])
@pytest.mark.parametrize("view", ["", "?view=compact"])
def test_a_phone_in_landscape_shows_state_force_and_vent_without_scrolling(shown, browser, view, touch):
    shown.set(force_n=1.5, force_std_n=0.05, status=["holding", "in_contact", "simulated"])
    shown.open(view, touch=touch)
    browser("resize", **LANDSCAPE)
    browser.wait_for_text("#force", "1.50")
    visible = ["#vent-button", "#bar-state", "#force .number", "#force .unit"]
    assert browser.evaluate(NOT_IN_VIEW_NOW % json.dumps(visible)) == []


LOG_IN_BY_LINK = """import("/static/session.js").then(({ Session }) => {
  location.hash = "user=%s&password=%s";
  const session = new Session(() => {});
  return session.start().then(() => [location.search + location.hash, session.user.name]);
})"""


def test_the_address_of_the_compact_view_may_contain_a_login(shown, browser):
    shown.open("?view=compact")
    assert browser.evaluate(LOG_IN_BY_LINK % (OPERATOR, PASSWORD)) == ["?view=compact", OPERATOR]
