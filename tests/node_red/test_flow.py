"""Tests of the generated flow in Node-RED, with an instrument on a simulated rig."""

import os
import signal

import pytest

from pneuforce.registers.advice import FAULT_ADVICE, REJECT_REASON_ADVICE
from pneuforce.registers.codes import FAULTS
from pneuforce.registers.views.node_red_tables import LEASE_MS, TICK_MS
from tests.system.waiting import wait_for
from tests.web.browser import NEEDS_CHROMIUM, NEEDS_PLAYWRIGHT, Browser

LEASE_EXPIRED = 32
FORCE = r"/-?\d\.\d{3} N ±/"  #: JavaScript


def test_the_force_setpoint_and_lease_are_those_of_the_instrument(plant):
    flow, rig = plant.node_red, plant.rig
    flow.inject("Force limit 5 N", topic="force_limit", payload=3.5)
    reading = plant.hold()
    assert reading["force_n"] == pytest.approx(0.0, abs=0.2)
    rig.press(1.5)
    reading = flow.wait_for_reading(lambda r: r["valid"] and r["force_n"] > 1.4)
    assert reading["force_n"] == pytest.approx(rig.read()["force"], abs=0.03)
    assert "in_contact" in reading["status"]
    rig.release()
    flow.inject("Setpoint 6 kPa", topic="setpoint", payload=5.5)
    flow.wait_for_reading(lambda r: r["valid"] and abs(r["setpoint_kpa"] - 5.5) < 1e-6)
    registers = rig.read()
    assert (registers["setpoint"], registers["force_limit"]) == (5.5, 3.5)
    assert registers["lease"] == LEASE_MS / 1000
    assert 0 < registers["lease_left"] <= LEASE_MS / 1000  # held for longer than the lease


def test_a_vent_during_the_inflation_vents_and_ends_the_lease(plant):
    flow = plant.node_red
    flow.inject("Hold")
    flow.wait_for_reading(lambda r: r.get("state") == "inflating")
    flow.inject("Vent now")
    reading = flow.wait_for_reading(lambda r: r.get("state") == "vented")
    assert not reading["valid"]
    assert "force_n" not in reading
    registers = plant.rig.read()
    assert (registers["state"], registers["lease"]) == ("vented", 0.0)


def test_a_silent_line_shows_no_value_and_a_vent_is_sent_as_soon_as_possible(plant):
    flow = plant.node_red
    plant.hold()
    plant.line.noise.cut = True
    reading = flow.wait_for_reading(lambda r: not r["connected"], 6 * TICK_MS / 1000)
    assert not reading["valid"]
    assert "force_n" not in reading
    notes = len(flow.seen()["notes"])
    flow.inject("Vent now")
    flow.wait_for_note("not accepted", notes)
    plant.line.noise.cut = False
    flow.wait_for_note("The vent was accepted", notes)
    plant.rig.wait_for(lambda registers: registers["mode"] == "vent")


def test_a_trip_shows_the_remedy_and_is_cleared_after_its_cause(plant):
    flow, rig = plant.node_red, plant.rig
    plant.hold()
    notes = len(flow.seen()["notes"])
    with rig.inject_fault("supply_low"):
        reading = flow.wait_for_reading(lambda r: r.get("fault"))
        assert not reading["valid"]
        code = rig.read()["first_out_fault"]  # board and host detect this fault at the same time
        what, remedy = FAULT_ADVICE[code]
        assert reading["fault"] == {"code": code, "name": FAULTS.names[code], "what": what, "remedy": remedy}
        flow.wait_for_note(remedy, notes)
        flow.inject("Hold")
        flow.wait_for_note("The hold was not started", notes)
        assert REJECT_REASON_ADVICE["cause_persists"] in flow.clear()
        # A clear while the balloon empties makes the board find the rest of the vent too short: fault 10.
        flow.wait_for_reading(lambda r: r.get("pressure_kpa", 1.0) < 0.1)
    wait_for(flow.clear, lambda answer: answer == "The faults are cleared.", 10.0)
    flow.wait_for_reading(lambda r: r.get("state") == "vented" and "fault" not in r)


def test_the_instrument_vents_if_node_red_stops(plant):
    flow, rig = plant.node_red, plant.rig
    plant.hold()
    os.kill(flow.pid, signal.SIGSTOP)
    try:
        rig.wait_for(lambda registers: registers["state"] == "tripped", LEASE_MS / 1000 + 2.0)
    finally:
        os.kill(flow.pid, signal.SIGCONT)
    reading = flow.wait_for_reading(lambda r: r.get("fault"))
    assert reading["fault"]["code"] == LEASE_EXPIRED
    assert "force_n" not in reading


def test_node_red_reports_no_error(plant):
    log = plant.node_red.log()
    assert "Started flows" in log
    assert "[error]" not in log
    assert "[warn]" not in log.replace("[warn] Projects disabled", "").replace("[warn] Using unencrypted", "")


@pytest.mark.slow
@NEEDS_CHROMIUM
@NEEDS_PLAYWRIGHT
def test_the_page_shows_the_force_and_no_value_after_node_red_has_stopped(plant):
    with Browser() as browser:
        browser("open", url=f"http://127.0.0.1:{plant.node_red.port}/dashboard/pneuforce")
        browser.wait("document.body.innerText.includes('State: vented')")
        assert "no value" in browser.text("body")
        click(browser, "Hold")
        browser.wait(f"{FORCE}.test(document.body.innerText)")
        os.kill(plant.node_red.pid, signal.SIGSTOP)
        try:
            browser.wait("document.body.innerText.includes('No message from Node-RED')")
            assert "no value" in browser.text("body")
            assert not browser.evaluate(f"{FORCE}.test(document.body.innerText)")
        finally:
            os.kill(plant.node_red.pid, signal.SIGCONT)
        click(browser, "Vent")
        plant.rig.wait_for(lambda registers: registers["mode"] == "vent")
        assert browser("errors") == []


def click(browser, label):
    browser.evaluate(f"[...document.querySelectorAll('button')].find(b => b.innerText == {label!r}).click()")
