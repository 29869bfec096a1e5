"""The whole instrument as its users run it: simulator, CAN hub and host process, on free ports."""

import json
import socket
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

import can
import pytest

from registers.modbus.client import Plc, PlcError
from teststand.children import Child
from teststand.stack import start


@dataclass
class Stack:
    """A running instrument and its simulated rig."""

    modbus_port: int
    can_port: int
    host: Child
    sim: Child
    control: socket.socket
    children: ExitStack
    link: Path

    def plc(self):
        return Plc.connect(port=self.modbus_port)

    def truths(self):
        """What the simulator says of each sample from now on."""
        self.order(truth=50)
        return map(json.loads, self.control.makefile())

    def plug_in_again(self):
        """A simulated rig at the end of the same cable."""
        self.sim = self.plug_in(self.link)

    def plug_in(self, link):
        """Another simulated rig."""
        arguments = ["instrument", "sim", "--link", str(link), "--no-hand"]
        sim = self.children.enter_context(Child("simulator", arguments))
        sim.ready()
        return sim

    def robot(self):
        """The CAN bus as a robot controller opens it."""
        return can.Bus("can0", "socketcand", host="127.0.0.1", port=self.can_port, tcp_tune=True)

    def order(self, **what):
        """Command the simulated hand."""
        self.control.sendall(json.dumps(what).encode() + b"\n")


@contextmanager
def running(link):
    with ExitStack() as children:
        parts = start(children, link, ["--no-hand"])
        control = children.enter_context(socket.create_connection(("127.0.0.1", parts.control_port)))
        yield Stack(parts.modbus_port, parts.can_port, parts.host, parts.sim, control, children, link)


@pytest.fixture
def stack(tmp_path):
    with running(tmp_path / "rig") as started:
        yield started


@pytest.fixture(scope="module")
def lasting_stack(tmp_path_factory):
    """For tests that leave it vented and whole."""
    with running(tmp_path_factory.mktemp("stack") / "rig") as started:
        yield started


def answers(port):
    try:
        Plc.connect(port=port).close()
    except PlcError:
        return False
    return True
