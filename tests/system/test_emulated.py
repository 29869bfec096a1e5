"""Tests of the instrument in real time with the firmware binary on the emulated board."""

import json
import os
import socket
import subprocess
import sys
from contextlib import ExitStack

import pytest

from pneuforce.registers.modbus.client import ModbusClient
from pneuforce.teststand.stack import start
from tests.sim.conftest import emulated
from tests.system.waiting import inflate, wait_for


@pytest.fixture
def stack(tmp_path):
    with ExitStack() as children:
        yield start(children, tmp_path / "rig", ["--no-hand", "--board", "avr"])


@emulated
def test_the_instrument_holds_measures_and_vents_with_the_status_bit_simulated(stack):
    with (
        ModbusClient.connect(port=stack.modbus_port) as plc,
        socket.create_connection(("127.0.0.1", stack.control_port)) as control,
    ):
        inflate(plc, 8.0)
        control.sendall(json.dumps({"press": 2.0}).encode() + b"\n")
        pressed = wait_for(plc.read, lambda v: v["force"] > 1.9)
        assert pressed["force"] == pytest.approx(2.0, abs=0.15)
        assert "simulated" in pressed["status"]
        plc.write("mode", "vent")
        wait_for(plc.read, lambda v: v["state"] == "vented")


def test_without_a_compiler_the_error_message_names_the_package(tmp_path):
    rejected = subprocess.run(
        [sys.executable, "-m", "pneuforce", "sim", "run", "--board", "avr", "--link", str(tmp_path / "rig")],
        env={**os.environ, "PATH": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert rejected.returncode == 69
    assert rejected.stderr.startswith("pneuforce: the simulator cannot start: the emulated board needs gcc: ")
    assert len(rejected.stderr.splitlines()) == 1
