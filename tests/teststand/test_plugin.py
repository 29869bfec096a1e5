"""The pytest plugin as integrators use it: outside this tree, found by its entry point."""

import math
import signal
import subprocess
import sys

import pytest

from registers.modbus.client import PlcError
from sim.faults import Refused
from tests.system.test_demo import running
from tests.system.waiting import wait_for
from teststand.rig import NotHeld, NotInTime, Tripped


def pytest_in(folder, program):
    """Run pytest there, as a user would, on a file with this program."""
    (folder / "tests").mkdir()
    (folder / "tests" / "test_mine.py").write_text(program)
    command = [sys.executable, "-P", "-m", "pytest", "-q", "-s", "-p", "no:cacheprovider", "tests"]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=60, check=False)


KILLED = """
import os, signal
from pathlib import Path

def test_that_is_killed(pneuforce_rig):
    Path("children").write_text(Path(f"/proc/self/task/{os.getpid()}/children").read_text())
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_test_that_is_killed_leaves_no_process_behind(tmp_path):
    (tmp_path / "sim.py").write_text(
        "raise SystemExit('a file of the user that is called like a part of ours')"
    )
    done = pytest_in(tmp_path, KILLED)
    assert done.returncode == -signal.SIGKILL, done.stdout
    children = [int(pid) for pid in (tmp_path / "children").read_text().split()]
    assert len(children) == 3
    wait_for(lambda: [pid for pid in children if running(pid)], lambda left: not left, deadline_s=3)


WRONG = """
import pytest

@pytest.mark.pneuforce(scenario="palpate")
def test_of_a_scenario_that_is_not_there(pneuforce_rig): pass

@pytest.mark.pneuforce(pressure=8.0)
def test_with_a_marker_that_says_something_else(pneuforce_rig): pass

@pytest.mark.pneuforce(instrument={"modbus": {"word_order": "BADC"}})
def test_with_a_configuration_that_is_refused(pneuforce_rig): pass
"""


def test_what_cannot_start_is_one_sentence(tmp_path):
    said = pytest_in(tmp_path, WRONG).stdout
    assert "the simulator ended: there is no scenario 'palpate', only campaign, " in said
    assert "the marker pneuforce does not take pressure; it is pneuforce(*, scenario=None, " in said
    assert "__init__" not in said
    assert "the instrument ended: instrument={…} of the marker pneuforce: modbus.word_order = 'BADC'" in said
    assert "3 errors" in said
    assert "Traceback" not in said
    assert "teststand/" not in said


def test_the_plugin_costs_those_nothing_who_do_not_use_it():
    heavy = "{'numpy', 'pydantic', 'pymodbus', 'can', 'serial', 'typer'}"
    program = f"import sys, pytest; import teststand.plugin; print({heavy} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout == "set()\n"


@pytest.mark.pneuforce(instrument={"modbus": {"word_order": "CDAB", "unit": 7}})
def test_it_reads_and_writes_registers_by_name_and_says_in_sentences_what_cannot_be(pneuforce_rig):
    rig = pneuforce_rig
    rig.write("force_limit", 3.5)
    registers = rig.wait_for(lambda registers: registers["state"] != "boot")
    assert registers["force_limit"] == 3.5
    assert registers["test_float"] == pytest.approx(-123.45)
    assert (registers["state"], registers["first_fault"]) == ("vented", 0)
    assert math.isnan(registers["force"])
    with pytest.raises(NotInTime, match=r"did not come in 0\.1 s: state vented, pressure "):
        rig.wait_for(lambda registers: registers["state"] == "holding", timeout_s=0.1)
    with pytest.raises(PlcError, match=r"setpoint_requested = 12\.5 was refused: .*; allowed: 2 … 12 kPa"):
        rig.inflate(12.5)
    with pytest.raises(
        Refused, match=r"there is no fault 'leek' \(near: leak\); pneuforce fault --list shows all"
    ):
        rig.fault("leek")
    with pytest.raises(NotHeld, match="the balloon is not held, inflate it first: state vented, pressure "):
        rig.press(2.0)
    assert rig.truth()["applied_n"] == 0.0


def test_a_press_that_trips_the_rig_says_so_unless_nobody_waits_for_it(pneuforce_rig):
    pneuforce_rig.inflate(8.0)
    with pytest.raises(Refused, match="press expects a force from 0 to 20 N"):
        pneuforce_rig.press(21.0)
    with pytest.raises(Tripped, match=r"the rig has tripped: overpressure \(fault 4\)"):
        pneuforce_rig.press(8.0)
    with pytest.raises(Tripped, match="remove its cause, clear it"):
        pneuforce_rig.press(1.0, wait=False)
    pneuforce_rig.release()


@pytest.mark.pneuforce(scenario="taps")
def test_a_fault_lasts_as_long_as_its_block_and_the_scenario_tells_its_setpoint(pneuforce_rig):
    with pneuforce_rig.fault("supply_low", mv=4100):
        tripped = pneuforce_rig.wait_for(lambda registers: registers["state"] == "tripped")
        assert "sensor_fault" in tripped["status"]
    pneuforce_rig.fault("sensor_drift", kpa=1.0)
    pneuforce_rig.fault_off("sensor_drift")
    assert pneuforce_rig.truth()["setpoint_kpa"] == 8.0


def test_a_line_between_rig_and_instrument_that_is_cut_and_whole_again(pneuforce_rig, pneuforce_serial_proxy):
    pneuforce_serial_proxy.noise.cut = True
    pneuforce_rig.wait_for(lambda registers: "link_lost" in registers["status"])
    pneuforce_serial_proxy.noise.cut = False
    back = pneuforce_rig.wait_for(lambda registers: "link_lost" not in registers["status"])
    assert back["state"] == "tripped"
