"""Running instrument for the tests of the Python package, with an address for each bus."""

from contextlib import ExitStack, contextmanager
from dataclasses import dataclass

from pneuforce.sim.line.proxy import TcpProxy
from pneuforce.teststand.rig import LiveRig
from pneuforce.teststand.stack import Stack, start
from tests.registers.modbus.serial_lines import Cable

FACES = ("tcp", "rtu", "can")


@dataclass
class RunningInstrument:
    """Instrument on a simulated rig, with its addresses."""

    stack: Stack
    rig: LiveRig
    line: Cable
    proxy: TcpProxy

    def url(self, face):
        if face == "rtu":
            return f"rtu://{self.line.ports[1]}?parity=none&baud=115200"
        if face == "proxy":
            return f"tcp://127.0.0.1:{self.proxy.port}"
        return {"tcp": self.rig.url, "can": f"{self.rig.can_url}&silence=0.3"}[face]

    def registers(self):
        return self.rig.read()


@contextmanager
def running_instrument(folder, **tables):
    """Run an instrument with Modbus TCP, Modbus RTU on a pty, and CAN."""
    with ExitStack() as children:
        line = Cable()
        children.callback(line.unplug)
        serial = {"enabled": True, "port": line.ports[0], "baud": 115200}
        stack = start(children, folder / "rig", ["--no-hand"], {"modbus_rtu": serial, **tables}, line_seed=1)
        proxy = children.enter_context(TcpProxy(("127.0.0.1", stack.modbus_port)))
        yield RunningInstrument(stack, LiveRig(stack), line, proxy)
