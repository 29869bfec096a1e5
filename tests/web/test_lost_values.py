"""Tests of the page in a real browser after the loss of the values, or of the samples of the rig."""

import time

from tests.system.waiting import wait_for
from tests.web.browser import NEEDS_CHROMIUM, NEEDS_PLAYWRIGHT

pytestmark = [NEEDS_CHROMIUM, NEEDS_PLAYWRIGHT]

VERIFY_TIMEOUT_S = 10.0  #: time after which the page reports a vent without any state as not verified
RIG_LOST = {"state": "tripped", "status": ["stale", "link_lost", "failure"], "force_n": None}
VENTED = {"state": "vented", "status": ["vented"], "force_n": None}
TEXTS = (
    "['#vent-status', '#announcements', '#alarm-announcements', '#proof-test'].map((id) => "
    "document.querySelector(id).textContent)"
)


def press_vent(shown, browser):
    """Press VENT, and wait until the instrument has received the request."""
    count = len(shown.requests)
    browser("press", key="Alt+v")
    wait_for(lambda: len(shown.requests), lambda now: now > count)


def test_without_values_a_verified_vent_is_in_the_past(shown, browser):
    shown.set()
    shown.open()
    browser.wait_for_text("#bar-state", "holding")
    press_vent(shown, browser)
    shown.set(**VENTED)
    browser.wait_for_text("#vent-status[data-state=verified]", "reads no pressure")
    browser.wait_for_text("#announcements", "vented")
    shown.be_silent()
    browser.wait_for_visible("#disconnected")
    vent_status, *others = browser.evaluate(TEXTS)
    assert vent_status.startswith("Last known")
    assert "reads" not in vent_status
    assert others == ["", "", ""]
    shown.set(**VENTED)
    browser.wait_for_text("#vent-status[data-state=verified]", "reads no pressure")
    shown.be_silent()
    browser.wait_for_visible("#disconnected")
    shown.set()
    browser.wait("document.querySelector('#vent-status').textContent === ''")


def test_a_vent_cannot_be_verified_while_the_rig_is_lost(shown, browser):
    shown.set(**RIG_LOST)
    shown.open()
    browser.wait("document.querySelector('#rig-link').dataset.link === 'down'")
    pressed_s = time.monotonic()
    press_vent(shown, browser)
    browser.wait_for_text("#vent-failed", "stop switch")
    assert time.monotonic() - pressed_s < VERIFY_TIMEOUT_S / 2
    shown.set(**VENTED)
    browser.wait_for_visible("#vent-status[data-state=verified]")
    assert browser.is_hidden("#vent-failed")


def test_the_loss_of_the_rig_during_a_vent_is_an_alarm_at_once(shown, browser):
    shown.set()
    shown.open()
    browser.wait_for_text("#bar-state", "holding")
    press_vent(shown, browser)
    browser.wait_for_visible("#vent-status[data-state=accepted]")
    lost_s = time.monotonic()
    shown.set(**RIG_LOST)
    browser.wait_for_text("#vent-failed", "stop switch")
    assert time.monotonic() - lost_s < VERIFY_TIMEOUT_S / 2
