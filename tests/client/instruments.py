"""Running instrument for the tests of the Python package, with an address for each bus."""

from contextlib import ExitStack, contextmanager
from dataclasses import dataclass

from pneuforce.sim.line.proxy import TcpProxy
from pneuforce.teststand.rig import LiveRig
from pneuforce.teststand.stack import Stack, free_port, start
from tests.registers.modbus.serial_lines import Cable

FACES = ("tcp", "rtu", "can", "rdt")


@dataclass
class RunningInstrument:
    """Instrument on a simulated rig, with its addresses."""

    stack: Stack
    rig: LiveRig
    line: Cable
    proxy: TcpProxy
    rdt_port: int

    def url(self, face):
        if face == "rtu":
            return f"rtu://{self.line.ports[1]}?parity=none&baud=115200"
        if face == "proxy":
            return f"tcp://127.0.0.1:{self.proxy.port}"
        if face == "rdt":
            return f"rdt://127.0.0.1:{self.rdt_port}"
        return {"tcp": self.rig.url, "can": f"{self.rig.can_url}&silence=0.3"}[face]

    def registers(self):
        return self.rig.read()


@contextmanager
def running_instrument(folder):
    """Run an instrument with Modbus TCP, Modbus RTU on a pty, CAN and RDT."""
    with ExitStack() as children:
        line = Cable()
        children.callback(line.unplug)
        serial = {"enabled": True, "port": line.ports[0], "baud": 115200}
        rdt = {"enabled": True, "port": free_port()}
        tables = {"modbus_rtu": serial, "rdt": rdt}
        stack = start(children, folder / "rig", ["--no-hand"], tables, line_seed=1)
        proxy = children.enter_context(TcpProxy(("127.0.0.1", stack.modbus_port)))
        yield RunningInstrument(stack, LiveRig(stack), line, proxy, rdt["port"])
