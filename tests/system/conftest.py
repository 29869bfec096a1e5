"""Fixtures: simulator, CAN hub and host process on free ports, as users run them."""

import json
import socket
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

import can
import pytest

from pneuforce.registers.modbus.client import ModbusClient, ModbusClientError
from pneuforce.teststand.child_process import ChildProcess
from pneuforce.teststand.stack import start


@dataclass
class Stack:
    """Running instrument and its simulated rig."""

    modbus_port: int
    can_port: int
    host: ChildProcess
    sim: ChildProcess
    control: socket.socket
    children: ExitStack
    link: Path

    def plc(self):
        return ModbusClient.connect(port=self.modbus_port)

    def truths(self):
        """Return an iterator over the true states from now on, one for every 50 samples."""
        self.request(truth=50)
        return map(json.loads, self.control.makefile())

    def unplug(self):
        """End the simulated rig as if its cable was pulled.

        A killed simulator leaves its link, which would later point to the pseudo-terminal of another test.
        """
        self.sim.stop()
        self.link.unlink(missing_ok=True)

    def plug_in_again(self):
        """Start a new simulated rig on the same link."""
        self.sim = self.plug_in(self.link)

    def plug_in(self, link):
        """Start and return a simulated rig on another link."""
        arguments = ["pneuforce", "sim", "run", "--link", str(link), "--no-hand"]
        sim = self.children.enter_context(ChildProcess("simulator", arguments))
        sim.ready()
        return sim

    def robot(self):
        """Open the CAN bus as a robot controller does."""
        return can.Bus("can0", "socketcand", host="127.0.0.1", port=self.can_port, tcp_tune=True)

    def request(self, **request):
        """Send a request to the control port, for example `press=2.0`."""
        self.control.sendall(json.dumps(request).encode() + b"\n")


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
def shared_stack(tmp_path_factory):
    """Start a stack that the tests of a module share. Each test must leave the rig vented and untripped."""
    with running(tmp_path_factory.mktemp("stack") / "rig") as started:
        yield started


def answers(port):
    try:
        ModbusClient.connect(port=port).close()
    except ModbusClientError:
        return False
    return True
