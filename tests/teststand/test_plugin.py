"""Pytest plugin as integrators use it: outside this project, found by its entry point."""

import math
import signal
import subprocess
import sys
import time
from contextlib import suppress

import pytest

import pneuforce
from pneuforce.testing import (
    BalloonNotHeld,
    ChildProcessFailed,
    ConfigurationError,
    ModbusClientError,
    RigTripped,
    SimulatorRequestError,
    VentFailed,
    WaitTimeout,
)
from tests.system.test_demo import running
from tests.system.waiting import wait_for


def is_cleared(sensor):
    """Clear the faults. Return True if the instrument accepted this command."""
    with suppress(pneuforce.Rejected):
        sensor.clear()
        return True
    return False


def pytest_in(folder, program, *arguments):
    """Run pytest in a folder, on a file with this program, as a user does."""
    (folder / "tests").mkdir()
    (folder / "tests" / "test_mine.py").write_text(program)
    command = [
        sys.executable,
        "-P",
        "-m",
        "pytest",
        "-q",
        "-s",
        "-p",
        "no:cacheprovider",
        *arguments,
        "tests",
    ]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=60, check=False)


KILLED = """
import os, signal
from pathlib import Path

def test_that_is_killed(pneuforce_rig):
    started = (thread.read_text() for thread in Path("/proc/self/task").glob("*/children"))
    Path("children").write_text(" ".join(started))
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_test_that_is_killed_leaves_no_process_behind(tmp_path):
    (tmp_path / "sim.py").write_text(
        "raise SystemExit('a file of the user has the name of a package of pneuforce')"
    )
    done = pytest_in(tmp_path, KILLED)
    assert done.returncode == -signal.SIGKILL, done.stdout
    children = [int(pid) for pid in (tmp_path / "children").read_text().split()]
    assert len(children) == 3
    wait_for(lambda: [pid for pid in children if running(pid)], lambda left: not left)


WRONG = """
import pytest

@pytest.mark.pneuforce(scenario="palpate")
def test_of_an_unknown_scenario(pneuforce_rig): pass

@pytest.mark.pneuforce(pressure=8.0)
def test_with_an_unknown_marker_argument(pneuforce_rig): pass

@pytest.mark.pneuforce(instrument={"modbus": {"word_order": "BADC"}})
def test_with_an_invalid_configuration(pneuforce_rig): pass

@pytest.mark.pneuforce(instrument={"modbus": 3})
def test_with_a_number_instead_of_a_table(pneuforce_rig): pass

@pytest.mark.pneuforce(instrument="instrument.toml")
def test_with_a_file_instead_of_tables(pneuforce_rig): pass
"""


def test_a_failed_start_is_reported_in_one_sentence(tmp_path):
    output = pytest_in(tmp_path, WRONG).stdout
    assert "the simulator ended with exit code " in output
    assert "'palpate'" in output
    assert "the marker pneuforce: pressure; use pneuforce(*, scenario=None, " in output
    assert "__init__" not in output
    assert "printed: instrument={…} of the marker pneuforce: modbus.word_order = 'BADC'" in output
    assert "marker pneuforce: instrument = {'modbus': 3} is invalid: it must contain tables" in output
    assert "marker pneuforce: instrument = 'instrument.toml' is invalid: it must contain tables" in output
    assert "5 errors" in output
    assert "Traceback" not in output
    assert "teststand/" not in output


@pytest.mark.parametrize(
    "name",
    sorted(
        set(pneuforce.testing.__all__) - {"LineNoise", "LiveRig", "SerialProxy", "TcpProxy", "simulated_rig"}
    ),
)
def test_all_exceptions_have_one_base_class(name):
    assert issubclass(getattr(pneuforce.testing, name), pneuforce.PneuforceError)


FAILED = """
import os, signal, time

def test_that_fails(pneuforce_rig):
    assert False

def test_that_does_not_see_the_end_of_the_simulator(pneuforce_rig):
    pneuforce_rig._stack.sim.send(signal.SIGKILL)
    while pneuforce_rig._stack.sim.running:
        time.sleep(0.01)

def test_that_kills_the_instrument(pneuforce_rig):
    pneuforce_rig.kill_instrument()
"""


def test_a_failed_test_shows_what_the_instrument_printed_and_an_unnoticed_end_is_an_error(tmp_path):
    done = pytest_in(tmp_path, FAILED, "--junitxml=junit.xml")
    assert "1 failed, 2 passed, 1 error" in done.stdout
    junit = (tmp_path / "junit.xml").read_text()
    for text in (done.stdout, junit):
        assert "[instrument] " in text
        assert "during the test, the simulator ended with the signal SIGKILL" in text


def test_a_program_reconnects_to_an_instrument_that_was_killed_and_started_again(pneuforce_rig):
    with pneuforce.connect(pneuforce_rig.url) as sensor:
        stream = sensor.stream(timeout_s=60.0)
        assert next(measurement for measurement in stream if measurement.sample_counter is not None)
        pneuforce_rig.kill_instrument()
        assert next(measurement for measurement in stream if measurement.sample_counter is None)
        with pytest.raises(ModbusClientError):
            pneuforce_rig.read()
        assert pneuforce_rig.truth()["force_n"] == 0.0
        pneuforce_rig.start_instrument()
        assert next(measurement for measurement in stream if measurement.sample_counter is not None)
    assert pneuforce_rig.read()["state"] in ("boot", "vented", "venting")


def test_a_paused_instrument_makes_the_stream_invalid_and_then_continues(pneuforce_rig):
    with pneuforce.connect(pneuforce_rig.url) as sensor:
        stream = sensor.stream(timeout_s=60.0)
        with pneuforce_rig.pause_instrument():
            assert next(measurement for measurement in stream if measurement.sample_counter is None)
        assert next(measurement for measurement in stream if measurement.sample_counter is not None)


def test_importing_the_plugin_imports_no_large_packages():
    heavy = "{'numpy', 'pydantic', 'pymodbus', 'can', 'serial', 'typer'}"
    program = f"import sys, pytest; import pneuforce.teststand.plugin; print({heavy} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout == "set()\n"


@pytest.mark.pneuforce(instrument={"modbus": {"word_order": "CDAB", "unit": 7}})
def test_registers_are_read_and_written_by_name_and_errors_are_explained(pneuforce_rig):
    rig = pneuforce_rig
    rig.write("force_limit", 3.5)
    registers = rig.wait_for(lambda registers: registers["state"] != "boot")
    assert registers["force_limit"] == 3.5
    assert registers["test_float"] == pytest.approx(-123.45)
    assert (registers["state"], registers["first_out_fault"]) == ("vented", 0)
    assert math.isnan(registers["force"])
    with pytest.raises(WaitTimeout, match=r"in 0\.1 s: state vented, pressure "):
        rig.wait_for(lambda registers: registers["state"] == "holding", timeout_s=0.1)
    for timeout_s in ("a", -1.0, math.nan, None):
        with pytest.raises(ConfigurationError, match=f"timeout_s = {timeout_s!r} is invalid"):
            rig.wait_for(bool, timeout_s)
    with pytest.raises(ModbusClientError, match="3: unknown register"):
        rig.write(3, 1)
    with pytest.raises(
        ModbusClientError, match=r"setpoint_requested = 12\.5 was rejected: .*; allowed: 2 … 12 kPa"
    ):
        rig.inflate(12.5)
    with pytest.raises(
        SimulatorRequestError,
        match=r"there is no fault 'leek' \(similar: leak.: pneuforce sim fault --list shows all faults",
    ):
        rig.inject_fault("leek")
    with pytest.raises(BalloonNotHeld, match=r"not held: state vented, pressure .*inflate"):
        rig.press(2.0)
    assert rig.truth()["applied_n"] == 0.0


@pytest.mark.parametrize(
    ("child", "call"),
    [
        ("instrument", lambda rig: rig.read()),
        ("instrument", lambda rig: rig.inflate(8.0)),
        ("simulator", lambda rig: rig.truth()),
        ("simulator", lambda rig: rig.start_contact(kind="tap")),
        ("simulator", lambda rig: rig.inflate(8.0)),
        ("CAN hub", lambda rig: rig.inflate(8.0)),
    ],
)
def test_the_first_call_after_the_end_of_a_process_names_the_process(pneuforce_rig, child, call):
    pneuforce_rig.wait_for(lambda registers: "not_zeroed" not in registers["status"])
    stack = pneuforce_rig._stack
    {"instrument": stack.host, "simulator": stack.sim, "CAN hub": stack.hub}[child].send(signal.SIGKILL)
    with pytest.raises(ChildProcessFailed, match=f"the {child} ended with the signal SIGKILL; .* printed: "):
        call(pneuforce_rig)


def test_a_press_that_trips_the_rig_raises_an_error(pneuforce_rig):
    pneuforce_rig.inflate(8.0)
    with pytest.raises(SimulatorRequestError, match="press expects a force from 0 to 20 N"):
        pneuforce_rig.press(21.0)
    with pytest.raises(RigTripped, match=r"the rig has tripped: overpressure \(fault 4\)"):
        pneuforce_rig.press(8.0)
    assert pneuforce_rig.truth()["applied_n"] == 8.0  # until the release
    with pytest.raises(RigTripped, match="clear the fault"):
        pneuforce_rig.press(1.0, wait=False)
    begun_s = time.monotonic()
    with pytest.raises(RigTripped, match=r"overpressure \(fault 4\).*allow_trip"):
        pneuforce_rig.wait_for(lambda registers: registers["state"] == "holding")
    assert time.monotonic() - begun_s < 1.0
    tripped = pneuforce_rig.wait_for(lambda registers: registers["first_out_fault"] == 4)
    assert tripped["state"] == "tripped"
    assert pneuforce_rig.wait_for(lambda registers: "vented" in registers["status"], allow_trip=True)
    pneuforce_rig.release()


@pytest.mark.parametrize(("fault", "name"), [("occluded", "occlusion"), ("vent_shut", "vent_shut")])
def test_a_failed_vent_raises_an_error_until_the_fault_is_cleared(pneuforce_rig, fault, name):
    pneuforce_rig.inflate(8.0)
    pneuforce_rig.inject_fault(fault)
    with pytest.raises(VentFailed, match="FAILED") as caught:
        pneuforce_rig.vent()
    assert caught.value.fault == name
    assert pneuforce_rig.truth()["balloon_kpa"] > 7
    pneuforce_rig.remove_fault(fault)
    with pytest.raises(VentFailed):
        pneuforce_rig.vent()
    with pneuforce.connect(pneuforce_rig.url) as sensor:
        wait_for(lambda: is_cleared(sensor), bool)  # the pressure must first be low for 0.5 s
    pneuforce_rig.vent()
    assert pneuforce_rig.truth()["balloon_kpa"] < 0.3


@pytest.mark.pneuforce(scenario="taps")
def test_a_fault_lasts_until_the_end_of_its_block_and_the_truth_contains_the_setpoint(pneuforce_rig):
    with pneuforce_rig.inject_fault("supply_low", mv=4100):
        tripped = pneuforce_rig.wait_for(lambda registers: registers["state"] == "tripped")
        assert "sensor_fault" in tripped["status"]
    with pneuforce_rig.inject_fault("sensor_drift", kpa=1.0):
        pneuforce_rig.remove_fault("sensor_drift")  # the end of the block then removes nothing
    with pytest.raises(SimulatorRequestError, match=r"sensor_drift was not active; active: no fault"):
        pneuforce_rig.remove_fault("sensor_drift")
    assert pneuforce_rig.truth()["setpoint_kpa"] == 8.0


def test_after_an_interruption_of_the_serial_line_the_rig_is_tripped(pneuforce_rig, pneuforce_serial_proxy):
    pneuforce_serial_proxy.noise.cut = True
    pneuforce_rig.wait_for(lambda registers: "link_lost" in registers["status"])
    pneuforce_serial_proxy.noise.cut = False
    back = pneuforce_rig.wait_for(lambda registers: "link_lost" not in registers["status"], allow_trip=True)
    assert back["state"] == "tripped"
