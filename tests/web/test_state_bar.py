"""Tests of the bar with VENT and the messages, in a real browser at three sizes."""

import json
import time

from pneuforce.registers.codes import FAULTS
from pneuforce.web.operator_texts import FAULT_TITLES
from tests.web.browser import NEEDS_CHROMIUM, NEEDS_PLAYWRIGHT
from tests.web.users import OPERATOR, PASSWORD

pytestmark = [NEEDS_CHROMIUM, NEEDS_PLAYWRIGHT]

SIZES = {
    "desktop": {"width": 1440, "height": 900},
    "tablet": {"width": 1024, "height": 768},
    "phone": {"width": 390, "height": 844},
}
VENT_SHUT = 9
BURST = 5
MAX_DELAY_S = 1.0
FORCE_ALARM_AND_UNPROVEN_TUBE = {
    "status": ["holding", "in_contact", "force_high_alarm"],
    "maintenance_causes": ["tube_unproven"],
    "force_n": 6.0,
    "force_uncompensated_n": 6.0,
    "force_limit_n": 5.0,
}

#: Elements that are not completely in view, or are covered, at one of three scroll positions.
NOT_IN_VIEW = """((selectors) => [0, 0.5, 1].flatMap((part) => {
  scrollTo(0, part * document.body.scrollHeight);
  return selectors.filter((selector) => {
    const element = document.querySelector(selector);
    const { top, left, bottom, right } = element.getBoundingClientRect();
    const isInside = top >= 0 && left >= 0 && bottom <= innerHeight && right <= innerWidth && bottom > top;
    const points = [[0.5, 0.5], [0.1, 0.2], [0.9, 0.8]].map(([x, y]) =>
      document.elementFromPoint(left + x * (right - left), top + y * (bottom - top)));
    return !isInside || !points.every((found) => element.contains(found));
  }).map((selector) => `${selector} at ${part}`);
}))(%s)"""
#: The same at the present scroll position.
NOT_IN_VIEW_NOW = NOT_IN_VIEW.replace("scrollTo(0, part * document.body.scrollHeight);", "")

#: Whether a field is invalid, and its errors that screen readers read with it.
FIELD_ERROR = """((id) => {
  const field = document.getElementById(id);
  const described = field.getAttribute("aria-describedby").split(" ");
  const errors = described.map((name) => document.getElementById(name)).filter(
    (element) => element.classList.contains("field-error") && element.textContent);
  return [field.ariaInvalid, ...errors.map(({ id }) => `#${id}`)];
})('%s')"""


def not_in_view(page, *selectors):
    """Return the elements that an operator cannot see at each scroll position."""
    return page.evaluate(NOT_IN_VIEW % json.dumps(selectors))


def test_a_failed_vent_is_announced_when_the_instrument_reports_it(page, live):
    """The vent valve of the simulated rig is stuck. The board reports the fault after 3 s."""
    live.rig.inflate(2.0)
    with live.rig.inject_fault("vent_shut"):
        page("press", key="Alt+v")
        live.rig.wait_for(lambda registers: registers["first_out_fault"] == VENT_SHUT)
        reported_s = time.monotonic()
        page.wait_for_visible("#vent-failed")
        assert time.monotonic() - reported_s <= MAX_DELAY_S
        page.wait_for_visible("#bar-fault[data-fault=vent_shut]")
        for name, size in SIZES.items():
            page("resize", **size)
            missing = not_in_view(page, "#vent-button", "#bar-state", "#bar-fault", "#vent-failed")
            assert (name, missing) == (name, [])
        page("press", key="Alt+v")  # a second vent does not hide the alarm
        assert not page.is_hidden("#vent-failed")
    live.recover()
    page.wait_for_hidden("#vent-failed")


def test_an_invalid_setpoint_is_reported_beside_its_field_and_in_view(page):
    page("resize", **SIZES["phone"])
    page("fill", on="#setpoint-input", text="12.5")
    page("press", key="Enter")
    page.wait_for_visible("#setpoint-error")
    assert page.evaluate(FIELD_ERROR % "setpoint-input") == ["true", "#setpoint-error"]
    assert page.evaluate(NOT_IN_VIEW_NOW % '["#setpoint-error", "#vent-button"]') == []
    page("fill", on="#setpoint-input", text="5")
    assert page.evaluate(FIELD_ERROR % "setpoint-input") == ["false"]


def test_a_fault_is_named_for_the_eye_and_the_ear(shown, browser):
    """The fault is active when the page is opened, before the page knows the names of the faults."""
    shown.set(state="tripped", faults=[BURST, 34], status=["burst", "failure"], force_n=None)
    shown.open()
    browser.wait_for_text("#alarm-announcements", FAULT_TITLES[34])
    announced = browser.text("#alarm-announcements")
    assert FAULT_TITLES[BURST] in announced
    assert "fault 5" not in announced
    browser.wait_for_visible(f"#bar-fault[data-fault={FAULTS.names[BURST]}]")
    assert FAULT_TITLES[BURST] in browser.text("#bar-fault")
    assert browser.text("#bar-fault-action") == "Check the balloon, the joint and the vent valve."
    for name, size in SIZES.items():
        browser("resize", **size)
        assert (name, not_in_view(browser, "#vent-button", "#bar-state", "#bar-fault")) == (name, [])
    spoken = "[...document.querySelector('#faults h3').childNodes].filter((n) => !n.ariaHidden)"
    assert browser.evaluate(f"{spoken}.map((n) => n.textContent).join('').trim()") == FAULT_TITLES[BURST]


def test_the_fault_in_the_bar_is_a_link_to_its_remedy(shown, browser):
    shown.set(state="tripped", faults=[BURST], status=["burst", "failure"], force_n=None)
    shown.open()
    browser.wait_for_visible("#bar-fault")
    for size in SIZES.values():
        browser("resize", **size)
        browser.evaluate("scrollTo(0, document.body.scrollHeight)")
        browser("click", on="#bar-fault")  # the whole alarm is the link
        browser.wait("document.activeElement.id === 'faults'")
        assert browser.evaluate(NOT_IN_VIEW_NOW % '["#faults-title", "#faults h3", "#vent-button"]') == []


def test_the_link_to_the_rig_has_its_own_state(shown, browser):
    links = "['link', 'rig-link'].map((id) => document.getElementById(id).dataset.link).join()"
    shown.set()
    browser.wait(f"{links} === 'up,up'")
    shown.set(status=["stale", "link_lost", "failure"], state="tripped", force_n=None)
    browser.wait(f"{links} === 'up,down'")


#: Readings whose unit is not beside its number.
WRAPPED_UNITS = """["force", "pressure", "radius", "setpoint"].filter((id) => {
  const [number, unit] = ["number", "unit"].map((name) =>
    document.querySelector(`#${id} .${name}`).getBoundingClientRect());
  const box = document.getElementById(id).getBoundingClientRect();
  const isBeside = unit.left >= number.right && unit.top < number.bottom && unit.right <= box.right;
  return !isBeside;
})"""


def test_each_unit_is_beside_its_number(shown, browser):
    shown.set(force_n=12.34, force_std_n=1.05, pressure_kpa=14.55, radius_mm=12.34, setpoint_kpa=11.45)
    shown.open()
    browser.wait_for_text("#pressure", "14.55")
    for name, size in (SIZES | {"small phone": {"width": 360, "height": 740}}).items():
        browser("resize", **size)
        assert (name, browser.evaluate(WRAPPED_UNITS)) == (name, [])


def test_a_note_below_the_force_does_not_move_the_page(shown, browser):
    top = "document.querySelector('#plots').getBoundingClientRect().top + scrollY"
    shown.set()
    shown.open()
    browser.wait_for_text("#bar-state", "holding")
    for name, size in SIZES.items():
        browser("resize", **size)
        shown.set()
        browser.wait_for_hidden("#force-touch")
        before = browser.evaluate(top)
        shown.set(status=["holding", "interpolated"])
        browser.wait_for_visible("#force-touch")
        assert (name, browser.evaluate(top)) == (name, before)


BUTTON_NAMES = "[...document.querySelectorAll('button')].map((button) => button.innerText.trim())"
#: Count how often the alarm about the force appears.
COUNT_APPEARANCES = """(() => {
  window.appearances = 0;
  const alarm = document.querySelector("#force-limit");
  new MutationObserver(() => (window.appearances += !alarm.hidden)).observe(alarm, { attributes: true });
})()"""


def test_each_button_has_its_own_name(shown, browser):
    shown.set()
    shown.open()
    browser.wait_for_text("#bar-state", "holding")
    names = [name for name in browser.evaluate(BUTTON_NAMES) if name]
    assert sorted(set(names)) == sorted(names)


def test_a_force_near_its_limit_does_not_make_the_alarm_blink(shown, browser):
    shown.set()
    shown.open()
    browser.wait_for_text("#bar-state", "holding")
    browser.evaluate(COUNT_APPEARANCES)
    for _ in range(5):
        shown.set(status=["holding", "force_high_alarm"])
        time.sleep(0.2)
        shown.set()
        time.sleep(0.3)
    assert browser.evaluate("window.appearances") == 1
    browser.wait_for_hidden("#force-limit")


SET_HIDDEN = """(() => {
  Object.defineProperty(document, "hidden", { value: %s, configurable: true });
  document.dispatchEvent(new Event("visibilitychange"));
})()"""


def test_a_hidden_tab_shows_an_alarm_in_its_title_until_another_tab_is_opened(shown, browser):
    shown.set()
    shown.open()
    browser.wait_for_text("#bar-state", "holding")
    browser.evaluate(SET_HIDDEN % "true")
    shown.set(state="tripped", faults=[BURST], status=["burst", "failure"], force_n=None)
    browser.wait(f"document.title.includes('{FAULT_TITLES[BURST]}')")
    browser.evaluate("new BroadcastChannel('pneuforce-stream').postMessage('opened')")
    browser.wait("document.title.startsWith('not connected')")
    shown.set()
    browser.evaluate(SET_HIDDEN % "false")
    browser.wait("document.title.includes('holding')")


def test_an_alarm_does_not_move_vent(shown, browser):
    """VENT must not move while an operator is about to press the button."""
    box = "JSON.stringify(document.querySelector('#vent-button').getBoundingClientRect())"
    for name, size in SIZES.items():
        browser("resize", **size)
        shown.set()
        browser.wait_for_hidden("#vent-failed")
        before = browser.evaluate(box)
        shown.set(state="tripped", faults=[VENT_SHUT], status=["vent_fault", "failure"], force_n=None)
        browser.wait_for_visible("#vent-failed")
        assert (name, browser.evaluate(box)) == (name, before)


def test_status_bits_that_ask_nothing_are_in_the_details(shown, browser):
    normal = ["holding", "in_contact", "simulated", "calibrated"]
    shown.set(status=normal)
    browser.wait("document.querySelectorAll('#other-status-bits li').length === 4")
    assert browser.evaluate("document.querySelectorAll('#status-bits .action').length") == 0
    assert not browser.evaluate("document.querySelector('#other-status-bits').checkVisibility()")
    shown.set(status=[*normal, "interpolated"], force_lower_range_limit_n=1.234)
    browser.wait_for_text("#status-bits .action", "1.23 N")
    browser.wait_for_text("#force-touch", "1.23 N")


def test_a_wrong_password_is_reported_beside_its_field(shown, browser):
    browser("resize", **SIZES["phone"])
    browser("fill", on="#user-name", text=OPERATOR)
    browser("fill", on="#password", text="wrong")
    browser("press", key="Enter")
    browser.wait_for_visible("#login-error")
    assert browser.evaluate(FIELD_ERROR % "password") == ["true", "#login-error"]
    assert browser.evaluate(NOT_IN_VIEW_NOW % '["#login-error", "#vent-button"]') == []
    browser("fill", on="#password", text=PASSWORD)
    assert browser.evaluate(FIELD_ERROR % "password") == ["false"]


def test_the_request_names_the_mode_before_the_setpoint(shown, browser):
    shown.set(mode="vent", setpoint_requested_kpa=6.0)
    shown.open()
    browser.wait_for_text("#setpoint-requested", "Requested: vent (setpoint 6.00 kPa)")


def test_before_the_texts_of_the_instrument_arrive_the_bar_shows_each_alarm(shown, browser):
    shown.set(**FORCE_ALARM_AND_UNPROVEN_TUBE)
    shown.open(without="/api/about")
    browser.wait_for_text("#vent", "Force above 5.00 N")
    browser.wait_for_text("#vent", "The tube was blocked")
    assert browser.text("#force .number") == "6.00"


def test_a_force_behind_the_alarms_is_in_the_bar(shown, browser):
    shown.set(**FORCE_ALARM_AND_UNPROVEN_TUBE)
    shown.open()
    browser.wait_for_text("#vent", "The tube was blocked")
    browser("resize", **SIZES["desktop"])
    browser.wait_for_hidden("#summary")
    browser("resize", width=844, height=330)
    browser.wait_for_text("#summary", "6.00 N")
    browser("resize", **SIZES["desktop"])
    browser.wait_for_hidden("#summary")


def test_a_lost_connection_does_not_end_the_warning_about_the_tube(shown, browser):
    shown.set(state="vented", status=["vented"], maintenance_causes=["tube_unproven"], force_n=None)
    shown.open()
    browser.wait_for_text("#tube-unproven", "The tube was blocked")
    shown.be_silent()
    browser.wait_for_text("#disconnected", "No values since")
    assert "The tube was blocked" in browser.text("#tube-unproven")
    shown.set()
    browser.wait_for_hidden("#tube-unproven")
