"""Tests of the force measurement over real serial bytes, real sockets and third-party clients."""

import math
import signal
import statistics
import subprocess
import time

import cantools
import pytest

from pneuforce.registers.modbus.client import ModbusClientError
from pneuforce.registers.views import VIEWS
from tests.system.waiting import inflate, start_inflation, wait_for
from tests.tools import needs

DBC = cantools.database.load_string(VIEWS["dbc"].render(), "dbc")
FORCE_ID = 0x185


def can_forces(bus, count):
    """Return the forces [N] of the next frames, decoded with the DBC as by a robot controller."""
    forces = []
    until_s = time.monotonic() + 5
    while len(forces) < count and time.monotonic() < until_s:
        frame = bus.recv(0.5)
        if frame is not None and frame.arbitration_id == FORCE_ID:
            forces.append(DBC.decode_message(FORCE_ID, frame.data)["force"])
    return forces


@pytest.fixture
def stack_to_vent(shared_stack):
    yield shared_stack
    with shared_stack.plc() as plc:
        plc.write("mode", "vent")


def mean_forces(plc, bus):
    """Return the mean force [N] on Modbus and on CAN during the same second.

    Single values belong to different samples, and have a noise of 5 mN from the lag compensation.
    """
    while bus.recv(0) is not None:
        pass
    on_modbus_n, on_can_n = [], []
    until_s = time.monotonic() + 1.0
    while time.monotonic() < until_s:
        on_modbus_n.append(plc.read()["force"])
        on_can_n += can_forces(bus, 1)
    return statistics.mean(on_modbus_n), statistics.mean(on_can_n)


def test_both_buses_report_the_true_force_of_a_pressed_balloon(stack_to_vent):
    stack = stack_to_vent
    with stack.plc() as plc, stack.robot() as bus:
        inflate(plc, 8.0)
        for applied_n in (1.5, 2.5):
            stack.request(press=applied_n)
            wait_for(plc.read, lambda v: "in_contact" in v["status"])
            wait_for(plc.read, lambda v, f=applied_n: abs(v["force"] - f) < 0.1)
            time.sleep(1.0)
            on_modbus_n, on_can_n = mean_forces(plc, bus)
            assert on_modbus_n == pytest.approx(
                applied_n, abs=0.02
            )  # the simulated balloon follows the force law
            assert on_can_n == pytest.approx(on_modbus_n, abs=0.004)
            values = plc.read()
            assert "force_valid" not in values["status"]  # only the condensed status has this bit
            assert "force_valid" in values["condensed_status"]
        stack.request(release=True)
        released = wait_for(plc.read, lambda v: "in_contact" not in v["status"])
        assert released["force"] == 0.0
        assert released["peak_force"] == pytest.approx(2.5, abs=0.1)
        assert released["contact_counter"] == 1


def mbpoll(stack, *arguments):
    command = ["mbpoll", "-m", "tcp", "-p", str(stack.modbus_port), "-0", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


@needs("mbpoll")
def test_the_rig_follows_a_setpoint_from_mbpoll(stack_to_vent):
    with stack_to_vent.plc() as plc:
        inflate(plc, 6.0)
        done = mbpoll(stack_to_vent, "-B", "-1", "-t", "4:float", "-r", "512", "127.0.0.1", "8.0")
        assert done.returncode == 0, done.stderr
        wait_for(plc.read, lambda v: v["state"] == "holding" and v["setpoint"] == 8.0)
        settled = wait_for(plc.read, lambda v: "holding" in v["status"])
        assert settled["pressure"] == pytest.approx(8.0, abs=0.12)


@needs("mbpoll")
@pytest.mark.parametrize("arguments", [("8.0",), ("-B", "12.5"), ("-B", "nan"), ("-B", "-1")])
def test_swapped_words_and_values_outside_the_range_are_rejected_without_effect(shared_stack, arguments):
    *order, value = arguments
    with shared_stack.plc() as plc:
        plc.write("setpoint_requested", 5.5)
        rejected = mbpoll(shared_stack, *order, "-1", "-t", "4:float", "-r", "512", "127.0.0.1", "--", value)
        assert "Illegal data value" in rejected.stderr
        assert plc.read()["setpoint_requested"] == 5.5


def test_writing_hold_repeatedly_does_not_inflate_a_tripped_rig(stack):
    with stack.plc() as plc:
        inflate(plc, 6.0)
        plc.write("lease", 0.3)
        wait_for(plc.read, lambda v: v["state"] == "tripped")
        until_s = time.monotonic() + 3.0
        while time.monotonic() < until_s:
            with pytest.raises(ModbusClientError, match="fault_latched"):
                plc.write("mode", "hold")
        values = plc.read()
        assert values["state"] == "tripped"
        assert values["pressure"] < 0.3
        assert math.isnan(values["setpoint"])


def test_after_a_trip_the_sequence_clear_vent_hold_inflates_again(stack):
    with stack.plc() as plc:
        inflate(plc, 6.0)
        plc.write("lease", 0.2)
        wait_for(plc.read, lambda v: v["state"] == "tripped")
        plc.write("command_key", 0x5046)
        plc.write("command_code", "clear_faults")
        plc.write("command_sequence", 1)
        cleared = wait_for(plc.read, lambda v: v["answer_state"] != "busy")
        assert (cleared["answer_state"], cleared["answer_result"]) == ("done", "none")
        with pytest.raises(ModbusClientError, match="reason state"):
            plc.write("mode", "hold")
        plc.write("mode", "vent")
        plc.write("mode", "hold")
        wait_for(plc.read, lambda v: v["state"] == "holding")


def test_the_board_vents_after_the_host_process_is_killed(stack):
    with stack.plc() as plc:
        inflate(plc, 6.0)
    truths = stack.truths()
    stack.host.send(signal.SIGKILL)
    wait_for(lambda: next(truths)["balloon_kpa"], lambda kpa: kpa < 0.3)


def suspend(stack, seconds):
    """Stop the host process for a time, as an overloaded computer does."""
    stack.host.send(signal.SIGSTOP)
    time.sleep(seconds)
    stack.host.send(signal.SIGCONT)


def test_a_suspended_host_process_reports_no_old_values_and_continues(stack):
    with stack.plc() as plc, stack.robot() as bus:
        inflate(plc, 8.0)
        stack.request(press=2.0)
        wait_for(plc.read, lambda v: abs(v["force"] - 2.0) < 0.05)
        stack.request(release=True)
        suspend(stack, 0.8)
        while bus.recv(0) is not None:
            pass
        seen = wait_for(plc.read, lambda v: v["sample_age"] < 0.1)
        assert seen["state"] == "holding"
        assert {force for force in can_forces(bus, 30) if force != "not_available"} <= {0.0}
        assert any("did not run" in line for line in stack.host.stderr_lines)


def test_a_host_process_that_is_suspended_while_the_balloon_fills_continues(stack):
    with stack.plc() as plc:
        start_inflation(plc, 8.0)
        wait_for(plc.read, lambda v: v["state"] == "inflating")
        for _ in range(3):
            suspend(stack, 0.5)
            time.sleep(0.1)
        wait_for(plc.read, lambda v: v["state"] == "holding")


def test_a_host_process_that_is_suspended_for_longer_than_its_time_limit_trips(stack):
    with stack.plc() as plc:
        inflate(plc, 8.0)
        suspend(stack, 3.0)
        assert wait_for(plc.read, lambda v: v["sample_age"] < 0.1)["state"] == "tripped"
        wait_for(plc.read, lambda v: "vented" in v["status"])


def test_after_the_cable_is_unplugged_and_plugged_in_the_rig_is_tripped(stack):
    with stack.plc() as plc:
        inflate(plc, 6.0)
        stack.unplug()
        lost = wait_for(plc.read, lambda v: "link_lost" in v["status"])
        assert math.isnan(lost["force"])
        assert math.isnan(lost["pressure"])
        stack.plug_in_again()
        back = wait_for(plc.read, lambda v: "link_lost" not in v["status"])
        assert back["state"] == "tripped"
        with pytest.raises(ModbusClientError, match="fault_latched"):
            plc.write("mode", "hold")
