"""The instrument on a serial line of its own: the whole of it, beside TCP and CAN."""

import signal
import time
from contextlib import ExitStack, suppress

import pytest
import serial

from instrument.cli.rtu_face import check_ports
from instrument.config import parse
from instrument.errors import ConfigurationError
from registers.modbus.client import Plc, PlcError
from registers.modbus.rtu import frame
from tests.registers.modbus.rtu_lines import VENT
from tests.registers.modbus.serial_lines import Cable
from tests.system.waiting import inflate, wait_for
from teststand.children import ChildFailed
from teststand.stack import start


@pytest.fixture
def children():
    with ExitStack() as children:
        yield children


def plug_in(link):
    """A new cable, its first end found under `link`."""
    cable = Cable()
    link.unlink(missing_ok=True)
    link.symlink_to(cable.ports[0])
    return cable


def started(children, folder, **rtu):
    return start(children, folder / "rig", ["--no-hand"], {"modbus_rtu": {"enabled": True, **rtu}})


def on_line(cable):
    return Plc.on_line(cable.ports[1], parity="none", wait_s=0.5)


def test_a_plc_on_the_line_inflates_and_a_broadcast_vents(children, tmp_path):
    cable = plug_in(tmp_path / "line")
    children.callback(cable.unplug)
    stack = started(children, tmp_path, port=str(tmp_path / "line"))
    with Plc.connect(port=stack.modbus_port) as tcp:
        with on_line(cable) as plc:
            inflate(plc, 5.0)
            plc.write("lease", 60.0)
            assert tcp.read()["lease_holder"] == "modbus_rtu"
            with pytest.raises(PlcError, match="reason lease"):
                tcp.write("setpoint_requested", 6.0)
        with serial.Serial(cable.ports[1], 19200) as master:
            master.write(frame(0, VENT))
        wait_for(tcp.read, lambda v: "vented" in v["status"])
        stack.host.send(signal.SIGTERM)
        wait_for(lambda: stack.host.running, lambda running: not running, 5.0)
    with serial.Serial(cable.ports[0], exclusive=True):
        pass


def test_the_line_is_pulled_and_comes_back_under_another_name_and_tcp_and_can_do_not_notice(
    children, tmp_path
):
    cable = plug_in(tmp_path / "line")
    stack = started(children, tmp_path, port=str(tmp_path / "line"))
    seen = []
    with Plc.connect(port=stack.modbus_port) as tcp:
        wait_for(tcp.read, lambda v: "can_down" not in v["status"] and "vented" in v["status"])

        def look():
            seen.append(tcp.read())
            with suppress(PlcError), on_line(cable) as plc:
                return plc.read()["sample_counter"]
            return 0

        assert look()
        cable.unplug()
        until_s = time.monotonic() + 0.7
        while time.monotonic() < until_s:
            seen.append(tcp.read())
        cable = plug_in(tmp_path / "line")
        children.callback(cable.unplug)
        begun_s = time.monotonic()
        assert wait_for(look, bool) >= seen[0]["sample_counter"]
        assert time.monotonic() < begun_s + 2.0
    assert not {"can_down", "link_lost", "any_failure"} & set().union(*(values["status"] for values in seen))
    assert {values["state"] for values in seen} == {"vented"}


def test_a_line_that_is_not_there_at_the_start_is_told_in_a_sentence(children, tmp_path):
    with pytest.raises(ChildFailed, match="Modbus RTU: /dev/no-such-line cannot be opened: no such file"):
        started(children, tmp_path, port="/dev/no-such-line")


def test_the_rigs_own_port_is_refused_under_whatever_name(tmp_path):
    (tmp_path / "alias").symlink_to(tmp_path / "rig")
    tables = {
        "rig": {"port": str(tmp_path / "rig")},
        "modbus_rtu": {"enabled": True, "port": str(tmp_path / "alias")},
    }
    with pytest.raises(ConfigurationError, match=r"modbus_rtu.port = \S*alias is the rig's own port"):
        check_ports(parse(tables, "my.toml"))
