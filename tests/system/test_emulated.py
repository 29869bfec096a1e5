"""The whole instrument in real time on the firmware's own binary, and what is said where that cannot be."""

import json
import os
import socket
import subprocess
import sys
from contextlib import ExitStack

import pytest

from registers.modbus.client import Plc
from tests.sim.conftest import emulated
from tests.system.waiting import inflate, wait_for
from teststand.stack import start


@pytest.fixture
def stack(tmp_path):
    with ExitStack() as children:
        yield start(children, tmp_path / "rig", ["--no-hand", "--board", "avr"])


@emulated
def test_it_holds_measures_and_vents_and_says_that_its_source_is_not_real(stack):
    with (
        Plc.connect(port=stack.modbus_port) as plc,
        socket.create_connection(("127.0.0.1", stack.control_port)) as control,
    ):
        inflate(plc, 8.0)
        control.sendall(json.dumps({"press": 2.0}).encode() + b"\n")
        pressed = wait_for(plc.read, lambda v: v["force"] > 1.9)
        assert pressed["force"] == pytest.approx(2.0, abs=0.15)
        assert "simulated" in pressed["status"]
        plc.write("mode", "vent")
        wait_for(plc.read, lambda v: v["state"] == "vented")


def test_without_a_compiler_the_simulator_says_what_to_install(tmp_path):
    refused = subprocess.run(
        [sys.executable, "-m", "instrument", "sim", "--board", "avr", "--link", str(tmp_path / "rig")],
        env={**os.environ, "PATH": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=30,
        check=False,
    )
    assert refused.returncode == 2
    assert refused.stderr.startswith("pneuforce: the simulator cannot start: the emulated board needs gcc: ")
    assert len(refused.stderr.splitlines()) == 1
