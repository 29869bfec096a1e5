"""Fixture: the function nodes of the Node-RED flow."""

from pathlib import Path

import pytest

from pneuforce.registers.views import node_red
from tests.registers.views.node_red_nodes import FunctionNodes

PROGRAM = Path(__file__).with_name("function_nodes.js")


@pytest.fixture(scope="session")
def node_process(tmp_path_factory):
    """Return the function nodes in the state in which the last test left them."""
    flow = tmp_path_factory.mktemp("flow") / "flow.json"
    flow.write_text(node_red.render())
    nodes = FunctionNodes(PROGRAM, flow)
    yield nodes
    nodes.close()


@pytest.fixture
def nodes(node_process):
    """Return the function nodes in the state after a deployment."""
    node_process.restart()
    return node_process
