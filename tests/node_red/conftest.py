"""Fixtures: one Node-RED and one instrument on a simulated rig for all tests, with a line that can fail."""

from contextlib import ExitStack
from dataclasses import dataclass

import pytest

from pneuforce.sim.line.proxy import TcpProxy
from pneuforce.teststand.rig import LiveRig
from pneuforce.teststand.running import simulated_rig
from tests.node_red.running import INSTALLED, NodeRed, node_red
from tests.system.waiting import wait_for


@dataclass
class Plant:
    """Instrument, its line, and Node-RED."""

    rig: LiveRig
    line: TcpProxy
    node_red: NodeRed

    def recover(self):
        """Vent, and clear the faults, through the flow."""
        self.rig.release(wait=False)
        notes = len(self.node_red.seen()["notes"])
        self.node_red.inject("Vent now")
        self.node_red.wait_for_note("The vent was accepted", notes)
        reading = self.node_red.wait_for_reading(lambda r: r.get("state") in ("vented", "tripped"))
        if reading.get("fault"):
            wait_for(self.node_red.clear, lambda answer: answer == "The faults are cleared.", 10.0)
            self.node_red.wait_for_reading(lambda r: r.get("state") == "vented")

    def hold(self):
        """Hold the balloon at 6 kPa through the flow, and return the first valid reading."""
        self.node_red.inject("Setpoint 6 kPa")
        self.node_red.inject("Hold")
        return self.node_red.wait_for_reading(lambda r: r["valid"], 15.0)


@pytest.fixture(scope="package")
def _plant(tmp_path_factory):
    if not INSTALLED:
        pytest.skip("Node-RED is missing: make test-node-red installs it, if npm and PyPI can be reached")
    with ExitStack() as children:
        rig = children.enter_context(simulated_rig())
        line = children.enter_context(TcpProxy(("127.0.0.1", rig.modbus_port)))
        flow = children.enter_context(node_red(tmp_path_factory.mktemp("node-red"), line.port))
        flow.wait_for_reading(lambda r: r.get("state") == "vented" and "not_zeroed" not in r["status"])
        yield Plant(rig, line, flow)


@pytest.fixture
def plant(_plant):
    """Return the plant with a vented balloon and without faults."""
    _plant.recover()
    return _plant
