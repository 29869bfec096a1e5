"""One instrument on a simulated rig for all peers: over TCP high word first, on a line low word first."""

from contextlib import ExitStack, contextmanager
from dataclasses import dataclass

import pytest

from registers.modbus.client import Plc
from tests.hostile.line import Line, Server
from tests.registers.modbus.serial_lines import Cable
from tests.system.waiting import wait_for
from teststand.stack import start


@dataclass(frozen=True)
class Instrument:
    """Where peers find it; they leave it vented."""

    port: int
    line: str

    @contextmanager
    def leased(self):
        """Another master, at another address, holds the lease."""
        with Line(Server(port=self.port), source="127.0.0.2") as other:
            assert other.said("06 0205 ea60") == "060205ea60"
            try:
                yield
            finally:
                assert other.said("06 0205 0000") == "0602050000"


@pytest.fixture(scope="package")
def instrument(tmp_path_factory):
    folder = tmp_path_factory.mktemp("peers")
    with ExitStack() as children:
        cable = Cable()
        children.callback(cable.unplug)
        (folder / "line").symlink_to(cable.ports[0])
        rtu = {"enabled": True, "port": str(folder / "line"), "word_order": "CDAB"}
        modbus = {"idle_s": 600.0}
        stack = start(children, folder / "rig", ["--no-hand"], {"modbus": modbus, "modbus_rtu": rtu})
        running = Instrument(stack.modbus_port, cable.ports[1])
        with Plc.connect(port=running.port) as plc:
            wait_for(plc.read, lambda v: "vented" in v["status"] and "not_zeroed" not in v["status"])
        yield running
