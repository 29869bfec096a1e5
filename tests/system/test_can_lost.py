"""Test of an instrument whose CAN bus fails: it measures, reports the failure, and connects again."""

from contextlib import ExitStack

import can
import pytest

from pneuforce.registers.can.frames import FORCE, decode
from pneuforce.registers.modbus.client import ModbusClient
from pneuforce.teststand.stack import start
from tests.registers.can.conftest import hub_process
from tests.system.waiting import wait_for


@pytest.fixture
def stack_parts(tmp_path):
    with ExitStack() as children:
        yield start(children, tmp_path / "rig", ["--no-hand"])


def test_a_failed_bus_does_not_disturb_the_instrument_and_is_reopened(stack_parts):
    with ModbusClient.connect(port=stack_parts.modbus_port) as plc:
        wait_for(plc.read, lambda v: "can_down" not in v["status"])
        stack_parts.hub.stop()
        down = wait_for(plc.read, lambda v: "can_down" in v["status"])
        assert {"can_down", "maintenance_required"} <= down["status"]
        assert "any_failure" not in down["status"]
        wait_for(plc.read, lambda v: v["sample_counter"] > down["sample_counter"] + 100)
        with hub_process(stack_parts.can_port) as (port, _), robot_bus(port) as robot:
            wait_for(plc.read, lambda v: "can_down" not in v["status"])
            force = next(m for m in robot if m.arbitration_id == 0x185)
            assert "simulated" in decode(FORCE, bytes(force.data))["condensed_status"]
    log = "\n".join(stack_parts.host.stderr_lines)
    for text in ("CAN is down: socketcand can0", "frames not sent (CAN is down) ", "CAN is up again"):
        assert text in log
    served = (f"Modbus TCP on 127.0.0.1:{stack_parts.modbus_port}", "205h Command", "[modbus_rtu]", "[rdt]")
    assert all(fact in log for fact in served)


def robot_bus(port):
    return can.Bus("can0", "socketcand", host="127.0.0.1", port=port, tcp_tune=True)
