"""System tests of Modbus RTU: the complete instrument with a serial line, TCP and CAN."""

import signal
import time
from contextlib import ExitStack, suppress

import pytest
import serial

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.config import parse
from pneuforce.instrument.service.buses.rtu_server import check_ports
from pneuforce.registers.modbus.client import ModbusClient, ModbusClientError
from pneuforce.registers.modbus.rtu import encode_frame
from pneuforce.teststand.child_process import ChildProcessFailed
from pneuforce.teststand.stack import start
from tests.registers.modbus.rtu_lines import VENT
from tests.registers.modbus.serial_lines import Cable
from tests.system.waiting import inflate, wait_for


@pytest.fixture
def children():
    with ExitStack() as children:
        yield children


def plug_in(link):
    """Return a new cable whose first end has the symbolic link `link`."""
    cable = Cable()
    link.unlink(missing_ok=True)
    link.symlink_to(cable.ports[0])
    return cable


def started(children, folder, **rtu):
    return start(children, folder / "rig", ["--no-hand"], {"modbus_rtu": {"enabled": True, **rtu}})


def connect_serial(cable):
    return ModbusClient.connect_serial(cable.ports[1], parity="none", wait_s=0.5)


def test_a_client_on_the_line_inflates_and_a_broadcast_vents(children, tmp_path):
    cable = plug_in(tmp_path / "line")
    children.callback(cable.unplug)
    stack = started(children, tmp_path, port=str(tmp_path / "line"))
    with ModbusClient.connect(port=stack.modbus_port) as tcp:
        with connect_serial(cable) as plc:
            inflate(plc, 5.0)
            plc.write("lease", 60.0)
            assert tcp.read()["lease_holder"] == "modbus_rtu"
            with pytest.raises(ModbusClientError, match="reason lease"):
                tcp.write("setpoint_requested", 6.0)
        with serial.Serial(cable.ports[1], 19200) as master:
            master.write(encode_frame(0, VENT))
        wait_for(tcp.read, lambda v: "vented" in v["status"])
        stack.host.send(signal.SIGTERM)
        wait_for(lambda: stack.host.running, lambda running: not running, 5.0)
    with serial.Serial(cable.ports[0], exclusive=True):
        pass


def test_an_unplugged_line_that_returns_with_another_name_does_not_affect_tcp_and_can(children, tmp_path):
    cable = plug_in(tmp_path / "line")
    stack = started(children, tmp_path, port=str(tmp_path / "line"))
    values_over_tcp = []
    with ModbusClient.connect(port=stack.modbus_port) as tcp:
        wait_for(tcp.read, lambda v: "can_down" not in v["status"] and "vented" in v["status"])

        def sample_counter_over_rtu():
            values_over_tcp.append(tcp.read())
            with suppress(ModbusClientError), connect_serial(cable) as plc:
                return plc.read()["sample_counter"]
            return 0

        assert sample_counter_over_rtu()
        cable.unplug()
        until_s = time.monotonic() + 0.7
        while time.monotonic() < until_s:
            values_over_tcp.append(tcp.read())
        cable = plug_in(tmp_path / "line")
        children.callback(cable.unplug)
        start_s = time.monotonic()
        assert wait_for(sample_counter_over_rtu, bool) >= values_over_tcp[0]["sample_counter"]
        assert time.monotonic() < start_s + 2.0
    assert not {"can_down", "link_lost", "any_failure"} & set().union(
        *(values["status"] for values in values_over_tcp)
    )
    assert {values["state"] for values in values_over_tcp} == {"vented"}


def test_a_missing_port_at_the_start_is_reported(children, tmp_path):
    with pytest.raises(
        ChildProcessFailed, match="Modbus RTU: /dev/no-such-line cannot be opened: no such file"
    ):
        started(children, tmp_path, port="/dev/no-such-line")


def test_the_port_of_the_rig_is_rejected_under_any_name(tmp_path):
    (tmp_path / "alias").symlink_to(tmp_path / "rig")
    tables = {
        "rig": {"port": str(tmp_path / "rig")},
        "modbus_rtu": {"enabled": True, "port": str(tmp_path / "alias")},
    }
    with pytest.raises(ConfigurationError, match=r"modbus_rtu.port = \S*alias.*rig.port"):
        check_ports(parse(tables, "my.toml"))
