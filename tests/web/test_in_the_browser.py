"""Tests of the web page in a real browser, with a complete instrument on a simulated rig."""

import signal
from urllib.parse import urlsplit

import pytest

from tests.web.browser import NEEDS_CHROMIUM, NEEDS_PLAYWRIGHT

pytestmark = [NEEDS_CHROMIUM, NEEDS_PLAYWRIGHT]

PHONE = {"width": 360, "height": 740}
TABLET = {"width": 900, "height": 1200}
PROJECTOR = {"width": 1920, "height": 1080}

#: Number of pixels with the colour of a legend key, in the rightmost part of the pressure plot.
PIXELS = """((part) => {
  const [r, g, b] = getComputedStyle(document.querySelector(".%s")).color.match(/\\d+/g).map(Number);
  const canvas = document.querySelector("#pressure-plot canvas");
  const { data } = canvas.getContext("2d").getImageData(
    canvas.width * (1 - part), 0, canvas.width * part, canvas.height);
  let count = 0;
  for (let at = 0; at < data.length; at += 4)
    count += data[at] === r && data[at + 1] === g && data[at + 2] === b;
  return count;
})(%s)"""
MIN_STAR_PIXELS = 20
VENT_VERIFIED = "#vent-status[data-state=verified]"
#: True if a vent was accepted, as shown by the page or, without scripts, by the title of the answer.
VENT_ACCEPTED = """document.querySelector('#vent-status')?.dataset.state === 'accepted'
  || document.querySelector('#vent-status')?.dataset.state === 'verified'
  || /^Vent(ed| accepted)/.test(document.title)"""

#: Return true after four further updates of the page, which take longer than a state takes to arrive.
STATE_SHOWN = """() => new Promise((resolve) => {
  let count = 0;
  document.addEventListener("instrument-state", ({ detail }) => detail && ++count === 4 && resolve(true));
})"""
#: Vent, and open the question as soon as the vent is accepted.
VENT_AND_ASK = """new Promise((resolve) => {
  document.addEventListener("vent-accepted",
    () => resolve(document.querySelector("#hold-button").click()), { once: true });
  document.querySelector("#vent-button").click();
})"""


def test_readings_and_a_contact_agree_with_modbus(page, live):
    live.rig.inflate(8.0)
    live.rig.press(2.0)
    registers = live.rig.read()
    page.wait_for_text("#state", "in contact")
    assert page.number("#force") == pytest.approx(registers["force"], abs=0.1)
    assert page.number("#pressure") == pytest.approx(registers["pressure"], abs=0.05)
    assert page.number("#radius") == pytest.approx(registers["radius"], abs=0.02)
    assert page.number("#setpoint") == 8.0
    live.rig.release()
    page.wait_for_text("#contacts tr td:last-child", ".")
    number, _, peak, peaks, initial, final, *_ = page.text("#contacts tr").split("\t")
    registers = live.rig.read()
    assert int(number) == registers["contact_counter"]
    assert float(peak.split()[0]) == pytest.approx(registers["peak_force"], abs=0.02)
    assert int(peaks) == registers["peak_counter"] == 1
    assert float(initial) == pytest.approx(8.0, abs=0.15)
    assert float(final) > float(initial) + 0.5
    assert page.evaluate(PIXELS % ("initial-star", 1)) > MIN_STAR_PIXELS
    assert page.evaluate(PIXELS % ("final-star", 1)) > MIN_STAR_PIXELS


def test_alt_v_vents(page, live):
    live.rig.inflate(5.0)
    page.wait_for_state("holding")
    page("click", on="#setpoint-input")
    page("press", key="Alt+v")
    live.rig.wait_for(lambda registers: registers["state"] in ("venting", "vented"))
    page.wait_for_visible(VENT_VERIFIED)
    assert "vented" in live.rig.read()["status"]


FAIL_FIRST_VENT = """(() => {
  const send = window.fetch;
  window.ventRequests = 0;
  window.fetch = (address, ...options) =>
    address === "/api/vent" && ++window.ventRequests === 1
      ? Promise.reject(new DOMException("", "%s"))
      : send(address, ...options);
})()"""


def test_a_vent_is_sent_again_if_its_connection_was_closed(page, live):
    live.rig.inflate(5.0)
    page.evaluate(FAIL_FIRST_VENT % "NetworkError")
    page("press", key="Alt+v")
    page.wait_for_visible(VENT_VERIFIED)
    assert page.evaluate("window.ventRequests") == 2
    assert live.rig.read()["mode"] == "vent"


def test_a_vent_without_an_answer_is_an_alarm_and_not_sent_again(page, live):
    live.rig.inflate(5.0)
    page.evaluate(FAIL_FIRST_VENT % "TimeoutError")
    page("press", key="Alt+v")
    page.wait_for_visible("#vent-failed")
    assert page.evaluate("window.ventRequests") == 1
    assert "did not answer within 3 s" in page.text("#vent-failed")


def test_an_operator_inflates_after_a_vent_a_setpoint_and_a_confirmation(page, live):
    page("click", on="#vent-button")
    page("fill", on="#setpoint-input", text="12.5")
    page("press", key="Enter")
    page.wait_for_text("#setpoint-error", "from 2 to 12 kPa")
    page("fill", on="#setpoint-input", text="5,5")
    page("press", key="Enter")
    page.wait_for_text("#result[data-code=setpoint_accepted]", "5.500 kPa")
    assert live.rig.read()["setpoint_requested"] == 5.5
    page.wait_for_text("#setpoint-requested", "5.50")
    page("fill", on="#setpoint-input", text="12.5")
    page("press", key="Enter")
    page.wait_for_text("#setpoint-error", "from 2 to 12 kPa")
    page.wait_for_hidden("#result")
    page("fill", on="#setpoint-input", text="6.5")
    page("click", on="#hold-button")
    assert "to 5.50 kPa" in page.text("#confirm-text")
    assert "The 6.50 kPa in the field are not set." in page.text("#confirm-text")
    page("press", key="Escape")
    assert live.rig.read()["mode"] == "vent"
    page("click", on="#hold-button")
    page("click", on="#confirm-yes")
    page.wait_for_text("#result[data-code=inflating]", "5.500 kPa")
    page.wait_for_text("#announcements", "State: holding, setpoint 5.50 kilopascals.")
    page.wait_for_state("holding")
    page.wait_for_hidden("#result")
    assert live.rig.read()["setpoint"] == 5.5
    assert page.data("#zero-reason", "code") == "not_vented"


@pytest.mark.parametrize("way", [("press", {"key": "Alt+v"}), ("click", {"on": "#vent-button"})])
def test_a_vent_cancels_an_open_confirmation(page, live, way):
    _ask_to_inflate(page)
    count = len(page("requestedUrls"))
    action, arguments = way
    page(action, **arguments)
    page.wait_for_visible(VENT_VERIFIED)
    assert page.is_hidden("#confirm")
    page.evaluate("document.querySelector('#confirm-yes').click()")
    page.evaluate("new Promise(requestAnimationFrame)")
    assert not [url for url in page("requestedUrls")[count:] if url.endswith("/api/write")]
    assert live.rig.read()["mode"] == "vent"


def test_a_changed_state_cancels_an_open_confirmation(page, live):
    _ask_to_inflate(page)
    live.rig.write("mode", "hold")
    page.wait_for_hidden("#confirm")


def test_a_vent_of_another_client_closes_the_question_about_an_inflation(page, live):
    """The balloon is already vented, so that no value in the question changes."""
    _ask_to_inflate(page)
    live.rig.write("mode", "vent")
    page.wait_for_text("#result[data-code=question_closed]", "Another client has requested a vent")
    assert page.is_hidden("#confirm")


def test_a_vent_of_another_client_does_not_close_the_question_about_a_new_balloon(page, live):
    """A PLC can write "vent" in each cycle."""
    page("fill", on="#balloon-input", text="13")
    page("press", key="Enter")
    page.wait_for_visible("#confirm")
    live.rig.write("mode", "vent")
    page.wait(f"({STATE_SHOWN})()")
    assert not page.is_hidden("#confirm")
    page("press", key="Escape")


def test_the_own_vent_does_not_close_a_question_that_was_opened_after_it(page, live):
    """The question opens before the page receives a state that contains its own vent."""
    _ask_to_inflate(page)
    page("press", key="Escape")
    page.evaluate(VENT_AND_ASK)
    page.wait(f"({STATE_SHOWN})()")
    assert not page.is_hidden("#confirm")
    page("press", key="Escape")


def _ask_to_inflate(page):
    page("click", on="#vent-button")
    page("fill", on="#setpoint-input", text="5")
    page("click", on="#setpoint-button")
    page.wait_for_text("#setpoint-requested", "5.00 kPa")
    page("click", on="#hold-button")
    page.wait_for_visible("#confirm")


def test_a_force_above_its_limit_is_shown_and_announced(page, live):
    live.rig.write("force_limit", 0.5)
    live.rig.inflate(8.0)
    live.rig.press(1.0)
    page.wait_for_text("#force-limit", "0.50 N")
    assert page.evaluate("document.querySelector('#force-limit').role") == "alert"
    assert "0.50 N" in page.text("#force-above")
    live.rig.release()
    page.wait_for_hidden("#force-limit")
    live.rig.write("force_limit", 5.0)


def test_a_fault_is_shown_with_its_action_and_can_be_cleared(page, live):
    live.rig.write("lease", 0.2)
    page.wait_for_visible("#faults [data-fault=lease_expired]")
    page.wait_for_text("#alarm-announcements", "lease expired")
    assert "→" not in page.text("#faults .action")  # the arrow is in the style sheet only
    assert page.text("#faults .action")
    assert page.data("#hold-reason", "code") == "tripped"
    page("click", on="#clear-button")
    page.wait_for_visible("#result[data-code=command_done]")
    page.wait_for_hidden("#faults")
    assert live.rig.read()["first_out_fault"] == 0


def test_a_new_balloon_has_a_number_and_no_inflations(page, live):
    live.rig.inflate(5.0)
    live.rig.vent()
    page.wait("document.querySelector('#balloon-button').ariaDisabled === 'false'")
    page("fill", on="#balloon-input", text="1e3")
    page("press", key="Enter")
    page.wait_for_text("#balloon-error", "whole number")
    page("fill", on="#balloon-input", text="12")
    page("press", key="Enter")
    page("click", on="#confirm-yes")
    page.wait_for_text("#balloon-in-use", "now 12 (0 inflations since the last start)")
    registers = live.rig.read()
    assert (registers["balloon_id"], registers["inflation_count"]) == (12, 0)


def test_a_setpoint_without_a_force_is_announced_before_the_inflation(page, live):
    page("click", on="#vent-button")
    page("fill", on="#setpoint-input", text="11.5")
    page.wait_for_text("#setpoint-warning", "4.95 to 11.45 kPa")
    page("fill", on="#setpoint-input", text="8")
    page.wait_for_hidden("#setpoint-warning")
    page("fill", on="#setpoint-input", text="3")
    page("press", key="Enter")
    page.wait_for_text("#setpoint-requested", "3.00 kPa")
    page("fill", on="#setpoint-input", text="")
    page("click", on="#hold-button")
    assert "4.95 to 11.45 kPa" in page.text("#confirm-text")
    page("click", on="#confirm-yes")
    page.wait_for_state("holding")
    page.wait_for_text("#force-missing", "4.95 to 11.45 kPa")


def test_after_a_trip_a_new_vent_is_required(page, live):
    page("click", on="#vent-button")
    page.wait_for_visible(VENT_VERIFIED)
    live.rig.write("lease", 0.2)
    page.wait_for_visible("#faults [data-fault=lease_expired]")
    page("click", on="#vent-button")  # a vent during a trip is not a step of the arming
    page("click", on="#clear-button")
    page.wait_for_visible("#result[data-code=command_done]")
    page.wait_for_visible("#hold-reason[data-code=vent_due]")
    _ask_to_inflate(page)
    page("click", on="#confirm-yes")
    page.wait_for_state("holding")


def test_the_time_axis_moves_on_while_the_board_is_silent(page, live):
    page("click", on="label:has([value='10'])")
    latest_pixels = PIXELS % ("pressure-key", 0.1)
    page.wait(latest_pixels)
    live.stack.sim.send(signal.SIGSTOP)
    try:
        page.wait(f"!{latest_pixels}")
        assert page.evaluate("document.body.classList.contains('stale')")
        page.wait("document.querySelector('#health .card-state').textContent === 'no samples'")
    finally:
        live.stack.sim.send(signal.SIGCONT)
    page.wait(latest_pixels)


@pytest.mark.parametrize(
    "broken", [{"without": "/main.js"}, {"scripts": False}], ids=["main script", "any script"]
)
def test_vent_works_without(broken, live, browser):
    browser("open", url=live.url, **broken)
    live.recover()  # only now, because the start of the page loads the machine
    try:
        live.rig.inflate(3.0)
        browser("click", on="#vent-button")
        browser.wait(VENT_ACCEPTED)
        assert live.rig.read()["mode"] == "vent"
    finally:
        live.log_in()


def test_the_inspector_shows_the_words_of_each_register(page):
    page.evaluate("document.querySelector('#inspector').open = true")
    page("fill", on="#filter", text="384")
    page.wait_for_text("#registers", "C2F6 E666")
    assert page.text("#registers tr:first-child").split("\t")[:4] == [
        "3840",
        "C2F6 E666",
        "test float",
        "−123.45",
    ]
    page("fill", on="#filter", text="force mn")
    page.wait_for_text("#registers", "7FFF")
    assert page.text("#registers tr:first-child").split("\t")[:5] == ["64", "7FFF", "force mn", "–", "mN"]


@pytest.mark.parametrize("size", [PHONE, TABLET, PROJECTOR], ids=["phone", "tablet", "projector"])
def test_vent_is_always_in_view_and_the_page_is_accessible(page, size):
    page.evaluate("document.querySelector('#inspector').open = true")
    for scheme in ("light", "dark"):
        page("resize", **size, scheme=scheme)
        serious = [found for found in page("audit") if found[1] in ("serious", "critical")]
        assert (scheme, serious) == (scheme, [])
    page("press", key="Alt+v")
    page.wait_for_visible(VENT_VERIFIED)
    page.evaluate("scrollTo(0, document.body.scrollHeight)")
    box = page.evaluate("document.querySelector('#vent-button').getBoundingClientRect().toJSON()")
    assert box["top"] >= 0 <= box["left"]
    assert box["bottom"] <= size["height"]
    assert box["right"] <= size["width"]
    assert box["height"] >= 44
    assert page.evaluate("document.documentElement.scrollWidth") <= size["width"]


def test_without_a_connection_readings_are_dashes_and_a_failed_vent_is_an_alarm(page, live):
    live.stack.host.send(signal.SIGSTOP)
    try:
        page.wait_for_visible("#disconnected")
        readings = ("force", "pressure", "radius", "state")
        assert [page.text(f"#{name} .number") for name in readings] == ["–"] * 4
        assert page.data("#setpoint-reason", "code") == "disconnected"
        assert page.data("#rig-link", "link") == "unknown"
        page("press", key="Alt+v")
        page.wait_for_text("#vent-failed", "NOT VENTED")
        assert page.text("#vent-failed").count("stop switch") == 1
    finally:
        live.stack.host.send(signal.SIGCONT)
    page.wait_for_hidden("#disconnected")
    page.wait_for_visible(VENT_VERIFIED)
    assert page.is_hidden("#vent-failed")


def test_a_killed_instrument_is_shown_again_after_its_restart(page, live):
    live.kill()
    page.wait_for_visible("#disconnected")
    assert page.evaluate("document.title").startswith("⚠ no values")
    page("press", key="Alt+v")
    page.wait_for_text("#vent-failed", "could not be reached")
    page.wait("document.title.startsWith('⚠ NOT VENTED')")
    assert page.text("#pressure .number") == "–"
    live.restart()
    page.wait_for_hidden("#disconnected")
    page.wait_for_text("#pressure", ".")
    # The list contains the event log from before the restart, with the latest record on top.
    page.wait(
        "[...document.querySelectorAll('#events .kind')].filter((k) => k.textContent === 'start').length > 1"
    )
    times = page.evaluate("[...document.querySelectorAll('#events time')].map((time) => time.dateTime)")
    assert times == sorted(times, reverse=True)
    page("reload")
    page.wait_for_text("#pressure", ".")
    page.wait_for_text("#events", "start")
    live.log_in()


def test_the_page_requests_nothing_from_other_machines_and_has_no_errors(page):
    assert {urlsplit(url).hostname for url in page("requestedUrls")} == {"127.0.0.1"}
    assert [text for text in page("errors") if "Failed to load resource" not in text] == []
