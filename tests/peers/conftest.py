"""Instrument on a simulated rig for all clients: ABCD word order over TCP, CDAB on the serial line."""

from contextlib import ExitStack, contextmanager
from dataclasses import dataclass

import pytest

from pneuforce.registers.modbus.client import ModbusClient
from pneuforce.teststand.stack import start
from tests.hostile.connection import RawConnection, ServerUnderTest
from tests.registers.modbus.serial_lines import Cable
from tests.system.waiting import wait_for


@dataclass(frozen=True)
class Instrument:
    """TCP port and serial port of the running instrument. Every test leaves the instrument vented."""

    port: int
    line: str

    @contextmanager
    def leased(self):
        """Let another master, with another address, hold the lease."""
        with RawConnection(ServerUnderTest(port=self.port), source="127.0.0.2") as other:
            assert other.request("06 0205 ea60") == "060205ea60"
            try:
                yield
            finally:
                assert other.request("06 0205 0000") == "0602050000"


@pytest.fixture(scope="package")
def instrument(tmp_path_factory):
    folder = tmp_path_factory.mktemp("peers")
    with ExitStack() as children:
        cable = Cable()
        children.callback(cable.unplug)
        (folder / "line").symlink_to(cable.ports[0])
        rtu = {"enabled": True, "port": str(folder / "line"), "word_order": "CDAB"}
        modbus = {"idle_timeout_s": 600.0}
        stack = start(children, folder / "rig", ["--no-hand"], {"modbus": modbus, "modbus_rtu": rtu})
        started = Instrument(stack.modbus_port, cable.ports[1])
        with ModbusClient.connect(port=started.port) as plc:
            wait_for(plc.read, lambda v: "vented" in v["status"] and "not_zeroed" not in v["status"])
        yield started
