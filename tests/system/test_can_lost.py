"""The whole instrument while its CAN bus goes away: it measures, it says so, and it comes back."""

from contextlib import ExitStack

import can
import pytest

from registers.can.frames import FORCE, decode
from registers.modbus.client import Plc
from tests.registers.can.conftest import hub_process
from tests.system.waiting import wait_for
from teststand.stack import start


@pytest.fixture
def parts(tmp_path):
    with ExitStack() as children:
        yield start(children, tmp_path / "rig", ["--no-hand"])


def test_a_bus_that_goes_disturbs_nothing_and_comes_back_by_itself(parts):
    with Plc.connect(port=parts.modbus_port) as plc:
        wait_for(plc.read, lambda v: "can_down" not in v["status"])
        parts.hub.stop()
        down = wait_for(plc.read, lambda v: "can_down" in v["status"])
        assert {"can_down", "maintenance"} <= down["status"]
        assert "any_failure" not in down["status"]
        wait_for(plc.read, lambda v: v["sample_counter"] > down["sample_counter"] + 100)
        with hub_process(parts.can_port) as (port, _), robot_on(port) as robot:
            wait_for(plc.read, lambda v: "can_down" not in v["status"])
            force = next(m for m in robot if m.arbitration_id == 0x185)
            assert "simulated" in decode(FORCE, bytes(force.data))["condensed_status"]
    said = "\n".join(parts.host.said)
    for words in ("CAN is down: socketcand can0", "frames not sent", "CAN is up again"):
        assert words in said


def robot_on(port):
    return can.Bus("can0", "socketcand", host="127.0.0.1", port=port, tcp_tune=True)
