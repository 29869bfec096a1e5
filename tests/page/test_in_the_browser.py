"""The page as people see it: a real browser, a whole instrument, a simulated rig."""

import signal
from urllib.parse import urlsplit

import pytest

from tests.page.browser import NEEDS_CHROMIUM, NEEDS_PLAYWRIGHT
from tests.page.conftest import TOKEN

pytestmark = [NEEDS_CHROMIUM, NEEDS_PLAYWRIGHT]

PHONE = {"width": 360, "height": 740}
TABLET = {"width": 900, "height": 1200}
PROJECTOR = {"width": 1920, "height": 1080}

#: Number of pixels, in the last parts of a plot, that have the colour of a part of its legend.
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
SMALL_STAR = 20
#: Whether it is told there that a vent was accepted: by the page, or by the server's bare answer.
WORDS_OF_A_VENT = r"/^Accepted|^\{.*none/.test(document.querySelector('%s').innerText)"


def test_numbers_and_a_contact_are_what_modbus_says(page, shown):
    shown.rig.inflate(8.0)
    shown.rig.press(2.0)
    registers = shown.rig.read()
    page.wait_for_text("#state", "in contact")
    assert page.number("#force") == pytest.approx(registers["force"], abs=0.1)
    assert page.number("#pressure") == pytest.approx(registers["pressure"], abs=0.05)
    assert page.number("#radius") == pytest.approx(registers["radius"], abs=0.02)
    assert page.number("#setpoint") == 8.0
    shown.rig.release()
    page.wait_for_text("#contacts tr td:last-child", ".")
    number, _, peak, initial, final, *_ = page.text("#contacts tr").split("\t")
    registers = shown.rig.read()
    assert int(number) == registers["contact_counter"]
    assert float(peak.split()[0]) == pytest.approx(registers["peak_force"], abs=0.02)
    assert float(initial) == pytest.approx(8.0, abs=0.15)
    assert float(final) > float(initial) + 0.5
    assert page("evaluate", script=PIXELS % ("initial-star", 1)) > SMALL_STAR
    assert page("evaluate", script=PIXELS % ("final-star", 1)) > SMALL_STAR


def test_a_key_vents(page, shown):
    shown.rig.inflate(5.0)
    page.wait_for_state("holding")
    page("click", on="#setpoint-wanted")
    page("press", key="Alt+v")
    shown.rig.wait_for(lambda registers: registers["state"] in ("venting", "vented"))
    page.wait_for_text("#vent-said", "Vented, verified")
    assert "vented" in shown.rig.read()["status"]


def test_an_operator_inflates_in_order_and_only_after_a_question(page, shown):
    page("click", on="#vent-button")
    page("fill", on="#setpoint-wanted", text="12.5")
    page("press", key="Enter")
    page.wait_for_text("#answer", "from 2 to 12 kPa")
    page("fill", on="#setpoint-wanted", text="5,5")
    page("press", key="Enter")
    page.wait_for_text("#answer", "Setpoint 5.500 kPa accepted")
    assert shown.rig.read()["setpoint_requested"] == 5.5
    page.wait_for_text("#setpoint-asked", "5.50")
    page("click", on="#hold-button")
    assert "will be inflated to 5.500 kPa" in page.text("#confirm")
    page("press", key="Escape")
    assert shown.rig.read()["mode"] == "vent"
    page("click", on="#hold-button")
    page("click", on="#confirm-yes")
    page.wait_for_text("#answer", "Inflating to 5.500 kPa")
    page.wait_for_state("holding")
    page.wait("document.querySelector('#answer').hidden")
    assert shown.rig.read()["setpoint"] == 5.5
    page.wait_for_text("#speech", "State: holding, setpoint 5.50 kilopascals.")
    assert "Vent first" in page.text("#zero-why")


@pytest.mark.parametrize("way", [("press", {"key": "Alt+v"}), ("click", {"on": "#vent-button"})])
def test_a_vent_takes_an_open_question_back(page, shown, way):
    _ask_to_inflate(page)
    asked = len(page("requested"))
    name, what = way
    page(name, **what)
    page.wait_for_text("#vent-said", "Vented, verified")
    assert page("evaluate", script="document.querySelector('#confirm').hidden")
    page("evaluate", script="document.querySelector('#confirm-yes').click()")
    page("evaluate", script="new Promise(requestAnimationFrame)")
    assert not [url for url in page("requested")[asked:] if url.endswith("/api/write")]
    assert shown.rig.read()["mode"] == "vent"


def test_a_question_does_not_outlive_what_it_was_asked_of(page, shown):
    _ask_to_inflate(page)
    shown.rig.write("mode", "hold")
    page.wait("document.querySelector('#confirm').hidden")


def _ask_to_inflate(page):
    page("click", on="#vent-button")
    page("fill", on="#setpoint-wanted", text="5")
    page("click", on="#setpoint-button")
    page.wait_for_text("#setpoint-asked", "5.00 kPa")
    page("click", on="#hold-button")
    page.wait("document.querySelector('#confirm').checkVisibility()")


def test_a_force_above_its_limit_is_in_view_and_said(page, shown):
    shown.rig.write("force_limit", 0.5)
    shown.rig.inflate(8.0)
    shown.rig.press(1.0)
    page.wait_for_text("#force-limit", "above the limit of 0.50 N")
    assert page("evaluate", script="document.querySelector('#force-limit').role") == "alert"
    assert "above the limit of 0.50 N" in page.text("#force-above")
    shown.rig.release()
    page.wait("document.querySelector('#force-limit').hidden")
    shown.rig.write("force_limit", 5.0)


def test_a_fault_is_told_with_what_to_do_and_cleared(page, shown):
    shown.rig.write("lease", 0.2)
    page.wait_for_text("#faults", "Lease expired")
    assert "→" not in page.text("#faults .remedy")  # the arrow is for the eye alone
    assert page.text("#faults .remedy")
    page.wait_for_text("#speech-of-alarms", "Fault: lease expired")
    assert "clear the faults first" in page.text("#hold-why")
    page("click", on="#clear-button")
    page.wait_for_text("#answer", "Clear faults: done.")
    page.wait("document.querySelector('#faults').hidden")
    assert shown.rig.read()["first_fault"] == 0


def test_after_a_trip_a_vent_comes_before_all_else(page, shown):
    page("click", on="#vent-button")
    page.wait_for_text("#vent-said", "Vented, verified")
    shown.rig.write("lease", 0.2)
    page.wait_for_text("#faults", "Lease expired")
    page("click", on="#vent-button")  # counts for nothing
    page("click", on="#clear-button")
    page.wait_for_text("#answer", "Clear faults: done.")
    page.wait_for_text("#hold-why", "Vent first")
    _ask_to_inflate(page)
    page("click", on="#confirm-yes")
    page.wait_for_state("holding")


def test_curves_move_on_while_the_board_is_silent(page, shown):
    page("click", on="label:has([value='10'])")
    at_the_end = PIXELS % ("pressure-key", 0.1)
    page.wait(at_the_end)
    shown.stack.sim.send(signal.SIGSTOP)
    try:
        page.wait(f"!{at_the_end}")
        assert page("evaluate", script="document.body.classList.contains('stale')")
    finally:
        shown.stack.sim.send(signal.SIGCONT)
    page.wait(at_the_end)


def test_a_stale_token_only_looks_and_vents(page, shown):
    page.wait("sessionStorage.getItem('operator')")
    page("evaluate", script="sessionStorage.setItem('operator', 'of yesterday')")
    page("reload")
    page.wait_for_text("#read-only", "READ-ONLY")
    shown.rig.inflate(5.0)
    page.wait_for_state("holding")
    assert "log in again" in page.text("#setpoint-why")
    page("click", on="#vent-button")
    page.wait_for_text("#vent-said", "Vented, verified")
    assert "vented" in shown.rig.read()["status"]
    page("fill", on="#token", text=TOKEN)
    page("press", key="Enter")
    page.wait("document.querySelector('#read-only').hidden")


@pytest.mark.parametrize(
    ("broken", "told_at"),
    [({"without": "main.js"}, "#vent-said"), ({"scripts": False}, "body")],
    ids=["its main script", "any script"],
)
def test_vent_works_without(broken, told_at, shown, browser):
    browser("open", url=shown.url, **broken)
    shown.recover()  # not before: a browser that begins keeps a machine busy
    try:
        shown.rig.inflate(3.0)
        browser("click", on="#vent-button")
        browser.wait(WORDS_OF_A_VENT % told_at)
        assert shown.rig.read()["mode"] == "vent"
    finally:
        browser("open", url=shown.operators_url)


def test_without_what_draws_curves_all_else_is_shown(shown, browser):
    shown.recover()
    browser("open", url=shown.operators_url, without="uPlot.esm.js")
    browser.wait_for_state("vented")
    browser.wait_for_text("#no-plots", "uPlot")
    browser("open", url=shown.operators_url)


def test_the_inspector_shows_words_as_they_are_on_the_wire(page):
    page("evaluate", script="document.querySelector('#inspector').open = true")
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
def test_vent_is_in_view_and_nobody_is_shut_out(page, size):
    page("evaluate", script="document.querySelector('#inspector').open = true")
    for scheme in ("light", "dark"):
        page("look", **size, scheme=scheme)
        serious = [found for found in page("audit") if found[1] in ("serious", "critical")]
        assert (scheme, serious) == (scheme, [])
    page("press", key="Alt+v")
    page.wait_for_text("#vent-said", "Vented, verified")
    page("evaluate", script="scrollTo(0, document.body.scrollHeight)")
    box = page("evaluate", script="document.querySelector('#vent-button').getBoundingClientRect().toJSON()")
    assert box["top"] >= 0 <= box["left"]
    assert box["bottom"] <= size["height"]
    assert box["right"] <= size["width"]
    assert box["height"] >= 44
    assert page("evaluate", script="document.documentElement.scrollWidth") <= size["width"]


def test_what_is_not_known_is_a_dash_and_a_vent_that_failed_is_loud(page, shown):
    shown.stack.host.send(signal.SIGSTOP)
    try:
        page.wait_for_text("#lost", "NOT CONNECTED since")
        assert [page.text(f"#{name} .number") for name in ("force", "pressure", "radius", "state")] == [
            "–"
        ] * 4
        assert "Not connected" in page.text("#setpoint-why")
        page("press", key="Alt+v")
        page.wait_for_text("#vent-failed", "NOT VENTED")
        assert page.text("#vent-failed").count("stop switch") == 1
    finally:
        shown.stack.host.send(signal.SIGCONT)
    page.wait("document.querySelector('#lost').hidden")
    page.wait_for_text("#vent-said", "Vented, verified")
    assert page("evaluate", script="document.querySelector('#vent-failed').hidden")


def test_an_instrument_that_was_killed_is_shown_again_when_it_is_back(page, shown):
    shown.kill()
    page.wait_for_text("#lost", "NOT CONNECTED since")
    assert page.text("#pressure .number") == "–"
    shown.start_again()
    page.wait("document.querySelector('#lost').hidden")
    page.wait_for_text("#pressure", ".")
    page("reload")
    page.wait_for_text("#pressure", ".")


def test_nothing_left_this_machine_and_nothing_was_forbidden(browser):
    assert {urlsplit(url).hostname for url in browser("requested")} == {"127.0.0.1"}
    assert [said for said in browser("complaints") if "Failed to load resource" not in said] == []
