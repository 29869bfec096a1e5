"""Tests of the decisions of the demo: when does it send commands?"""

import math

import pytest

from pneuforce.registers.modbus.client import ModbusClientError
from pneuforce.teststand.demo_sequence import DemoSequence

IDLE = {"status": set(), "state": "vented", "mode": "vent", "lease_holder": "none"}
UNSET = IDLE | {"setpoint_requested": math.nan}
HOLDING = IDLE | {"state": "holding", "mode": "hold", "setpoint_requested": 8.0}
VENTED = HOLDING | {"state": "vented", "mode": "vent"}
TRIPPED = VENTED | {"state": "tripped"}


class RecordingPlc:
    """Modbus client that records the writes and reports an overload fault."""

    def __init__(self):
        self.writes = []
        self.rejects = False

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def write(self, name, value):
        if self.rejects:
            raise ModbusClientError("rejected")
        self.writes.append((name, value))

    def read_all(self):
        return {"first_out_fault": 34}

    def run_command(self, code, timeout_s):
        self.write("command_code", code)
        return "none"


@pytest.fixture
def plc():
    return RecordingPlc()


@pytest.fixture
def demo(plc):
    """Demo that has inflated the balloon to 8 kPa."""
    demo = DemoSequence(lambda: plc)
    demo.step(UNSET, 8.0)
    assert plc.writes == [("mode", "vent"), ("setpoint_requested", 8.0), ("mode", "hold")]
    plc.writes.clear()
    return demo


def test_no_command_is_sent_before_the_zero_adjustment(plc):
    DemoSequence(lambda: plc).step(UNSET | {"status": {"not_zeroed"}}, 8.0)
    assert not plc.writes


def test_a_new_setpoint_of_the_scenario_is_written_without_a_vent(demo, plc):
    demo.step(HOLDING, 10.0)
    assert plc.writes == [("setpoint_requested", 10.0)]


def test_after_a_trip_by_an_overload_the_demo_clears_the_fault_and_inflates_again(demo, plc):
    demo.step(HOLDING, 8.0)
    demo.step(TRIPPED, 8.0)
    assert ("command_code", "clear_faults") in plc.writes
    assert plc.writes[-1] == ("mode", "hold")


def test_a_balloon_that_a_user_vented_before_the_trip_stays_vented(demo, plc):
    for values in (HOLDING, VENTED, TRIPPED, TRIPPED):
        demo.step(values, 8.0)
    assert not plc.writes


@pytest.mark.parametrize("change", [{"setpoint_requested": 9.0}, {"lease_holder": "modbus_tcp"}])
def test_the_demo_ends_when_another_client_takes_over(demo, plc, change):
    demo.step(HOLDING | change, 10.0)
    demo.step(HOLDING, 12.0)
    assert not plc.writes


def test_a_rejected_command_ends_the_demo(demo, plc):
    plc.rejects = True
    demo.step(HOLDING, 10.0)
    plc.rejects = False
    demo.step(HOLDING, 10.0)
    assert not plc.writes


def test_after_a_trip_the_demo_tries_again_until_its_commands_are_accepted(demo, plc):
    demo.step(HOLDING, 8.0)
    plc.rejects = True
    for _ in range(3):
        demo.step(TRIPPED, 8.0)
    assert not plc.writes
    plc.rejects = False
    demo.step(TRIPPED, 8.0)
    assert plc.writes[-1] == ("mode", "hold")
