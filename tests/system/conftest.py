"""The whole instrument as its users run it: simulator, CAN hub and host process, on free ports."""

import json
import socket
from contextlib import ExitStack
from dataclasses import dataclass

import can
import pytest

from instrument.cli.children import Child
from registers.modbus.client import Plc, PlcError
from tests.ports import free_port


@dataclass
class Stack:
    """A running instrument and its simulated rig."""

    modbus_port: int
    can_port: int
    host: Child
    sim: Child
    control: socket.socket
    children: ExitStack
    sim_arguments: list[str]

    def plc(self):
        return Plc.connect(port=self.modbus_port)

    def truths(self):
        """What the simulator says of each sample from now on."""
        self.order(truth=50)
        return map(json.loads, self.control.makefile())

    def plug_in_again(self):
        """A simulated rig at the end of the same cable."""
        self.sim = self.children.enter_context(Child("simulator", self.sim_arguments))
        self.sim.ready()

    def robot(self):
        """The CAN bus as a robot controller opens it."""
        return can.Bus("can0", "socketcand", host="127.0.0.1", port=self.can_port, tcp_tune=True)

    def order(self, **what):
        """Command the simulated hand."""
        self.control.sendall(json.dumps(what).encode() + b"\n")


@pytest.fixture
def stack(tmp_path):
    with ExitStack() as children:
        link, hub_port, modbus_port = tmp_path / "rig", free_port(), free_port()
        arguments = ["instrument", "sim", "--link", str(link), "--no-hand"]
        sim = children.enter_context(Child("simulator", arguments))
        hub = children.enter_context(Child("hub", ["registers.can.hub", "--port", str(hub_port)]))
        control_port = sim.ready()["control"]
        hub.ready()
        file = tmp_path / "instrument.toml"
        file.write_text(
            f'[rig]\nport = "{link}"\n[modbus]\nport = {modbus_port}\n'
            f'[can]\nenabled = true\ninterface = "socketcand"\nport = {hub_port}\n'
        )
        host = children.enter_context(Child("instrument", ["instrument", "run", "--config", str(file)]))
        host.ready()
        control = children.enter_context(socket.create_connection(("127.0.0.1", control_port)))
        yield Stack(modbus_port, hub_port, host, sim, control, children, arguments)


def answers(port):
    try:
        Plc.connect(port=port).close()
    except PlcError:
        return False
    return True
