"""Tests of the page in a real browser after the loss of the values, or of the samples of the rig."""

import time

from pneuforce.web.browser_feed import OPEN_CONTACT_PERIOD_S
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


def show_contact(shown, browser):
    """Open the page of a held balloon, and show a contact of 2 N that has not ended."""
    shown.set()
    shown.open()
    browser.wait_for_text("#bar-state", "holding")
    shown.send_samples(0.5, in_contact=True, force_n=2.0, force_std_n=0.1, rise_kpa=1.0)
    browser.wait_for_text("#contacts", "in contact")


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


def test_a_vent_that_gets_no_answer_after_a_vent_fault_is_shown_with_its_time(shown, browser):
    fault = {"state": "tripped", "status": ["vent_fault", "failure"], "faults": [10], "force_n": None}
    shown.set(**fault)
    shown.open(without="/api/vent")
    browser.wait_for_text("#vent-failed", "NOT VENTED. ")
    shown.be_silent()
    browser.wait_for_visible("#disconnected")
    browser("press", key="Alt+v")
    browser.wait_for_text("#vent-failed", "NOT VENTED at")
    assert "could not be reached" in browser.text("#vent-failed")
    assert "do not pull it out" in browser.text("#vent-failed")
    shown.set(**fault)
    browser.wait_for_text("#vent-failed", "NOT VENTED. ")


def test_after_a_blocked_tube_no_vent_is_shown_as_verified(shown, browser):
    shown.set(**VENTED, maintenance_causes=["tube_unproven"])
    shown.open()
    browser.wait_for_visible("#tube-unproven")
    press_vent(shown, browser)
    browser.wait_for_text("#vent-failed", "NOT VERIFIED: the tube was blocked")
    assert browser.text("#vent-status") == ""
    shown.set(maintenance_causes=["tube_unproven"])  # a proof test needs an inflated balloon
    browser.wait_for_hidden("#vent-failed")
    assert not browser.is_hidden("#tube-unproven")


def test_without_samples_of_the_rig_no_contact_is_shown_as_open(shown, browser):
    show_contact(shown, browser)
    shown.set(**RIG_LOST)
    browser.wait_for_text("#contacts", "ago")
    assert "in contact" not in browser.text("#contacts")
    assert "now" not in browser.text("#contacts")


def test_the_contacts_stay_after_the_loss_of_the_instrument(shown, browser):
    show_contact(shown, browser)
    shown.send_samples(0.5)
    browser.wait_for_text("#contacts", "ago")
    shown.be_silent()
    browser.wait_for_visible("#disconnected")
    assert "2.00 ± 0.20" in browser.text("#contacts")
    assert "ago" not in browser.text("#contacts")
    assert browser.is_hidden("#no-contacts")


def test_a_contact_that_ends_while_the_values_are_late_is_not_shown_as_open(shown, browser):
    show_contact(shown, browser)
    shown.be_late(3.0)
    browser.wait_for_visible("#disconnected")
    shown.send_samples(0.5)
    time.sleep(2 * OPEN_CONTACT_PERIOD_S)
    shown.be_late(0.0)
    browser.wait_for_hidden("#disconnected")
    browser.wait("!document.querySelector('#contacts').textContent.includes('in contact')")
