"""Tests of the confirmation dialog beside the bar with VENT and the alarms, at many sizes of the window."""

import json

import pytest

from tests.web.browser import NEEDS_CHROMIUM, NEEDS_PLAYWRIGHT
from tests.web.test_state_bar import FORCE_ALARM_AND_UNPROVEN_TUBE, NOT_IN_VIEW_NOW

pytestmark = [NEEDS_CHROMIUM, NEEDS_PLAYWRIGHT]

SIZES = [(390, 844), (844, 390), (640, 400), (667, 375), (800, 600), (932, 430), (1280, 800)]
#: A small phone, and a desktop at a zoom of 400 %. The dialog covers the alarms there.
SMALL_SIZES = [(568, 320), (320, 200)]
UNPROVEN_TUBE = {
    "state": "vented",
    "status": ["vented"],
    "maintenance_causes": ["tube_unproven"],
    "pressure_kpa": 0.0,
    "force_n": None,
}
STATES = {
    "unproven tube": (UNPROVEN_TUBE, "#tube-unproven"),
    "and force alarm": (FORCE_ALARM_AND_UNPROVEN_TUBE, "#force-limit"),
}
ASK = """import("/static/questions.js").then(async ({ inflateQuestion }) => {
  const { title, text, confirmLabel } = inflateQuestion(7, 0, 4, %s);
  const { askConfirmation } = await import("/static/confirm.js");
  askConfirmation(title, text, confirmLabel);
})"""
WARNING = "No force is measured at 4.00 kPa, but only from 4.95 to 11.45 kPa."
VENT_STATUS = "Vented 15:25:15: the sensor reads no pressure. Look at the balloon."
DRAWN = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(true))))"


def hidden_at(browser, *selectors):
    """Return the elements that cannot be seen or pressed: VENT at once, the others after a scroll."""
    browser.evaluate(DRAWN)
    hidden = browser.evaluate(NOT_IN_VIEW_NOW % '["#vent-button"]')
    for selector in selectors:
        browser.evaluate(f"document.querySelector('{selector}').scrollIntoView({{ block: 'nearest' }})")
        hidden += browser.evaluate(NOT_IN_VIEW_NOW % json.dumps([selector]))
    return hidden


@pytest.mark.parametrize("name", STATES)
def test_an_alarm_does_not_cover_the_buttons_of_a_question(shown, browser, name):
    state, alarm = STATES[name]
    shown.set(**state)
    shown.open()
    browser.wait_for_visible(alarm)
    browser.evaluate(f"document.querySelector('#vent-status').textContent = {json.dumps(VENT_STATUS)}")
    browser.evaluate(ASK % json.dumps(WARNING))
    browser.wait_for_visible("#confirm")
    buttons = ("#confirm-yes", "#confirm-no")
    for width, height in SIZES:
        browser("resize", width=width, height=height)
        assert (width, height, hidden_at(browser, *buttons, "#tube-unproven")) == (width, height, [])
    for width, height in SMALL_SIZES:
        browser("resize", width=width, height=height)
        assert (width, height, hidden_at(browser, *buttons)) == (width, height, [])


def test_an_alarm_that_begins_during_a_question_does_not_cover_its_buttons(shown, browser):
    shown.set()
    shown.open()
    browser("resize", width=844, height=390)
    browser.wait_for_text("#bar-state", "holding")
    browser.evaluate(ASK % json.dumps(WARNING))
    shown.set(**FORCE_ALARM_AND_UNPROVEN_TUBE)
    browser.wait_for_visible("#force-limit")
    assert hidden_at(browser, "#confirm-yes", "#confirm-no", "#force-limit") == []
