"""Tests of the start on a CAN bus: the instrument ends with an error message if it cannot use the bus."""

import subprocess
import sys

import pytest

from pneuforce.instrument.cli.terminal.exit_codes import ExitCode
from tests.system.waiting import wait_for


@pytest.fixture
def startup_error(tmp_path, stack):
    """Return a function that starts an instrument with a [can] table and returns its last error line."""
    link = tmp_path / "other"
    stack.plug_in(link)

    def run(table):
        off = '[modbus]\nenabled = false\n[events]\nfile = ""\n'
        configuration = f'[rig]\nport = "{link}"\n{off}[can]\nenabled = true\n{table}'
        done = subprocess.run(
            [sys.executable, "-m", "pneuforce", "run", "--config", "/dev/stdin"],
            input=configuration,
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
        assert (done.returncode, done.stdout) == (ExitCode.UNAVAILABLE, "")
        return done.stderr.splitlines()[-1]

    return run


@pytest.mark.parametrize("mode", ["raw", "canopen"])
def test_a_node_id_that_another_instrument_uses_ends_the_instrument(stack, startup_error, mode):
    with stack.plc() as plc:
        wait_for(plc.read, lambda registers: "can_down" not in registers["status"])
    error = startup_error(f'mode = "{mode}"\ninterface = "socketcand"\nport = {stack.can_port}\n')
    assert error.startswith("pneuforce: CAN node id 5 ")
    assert f"socketcand can0 at 127.0.0.1:{stack.can_port}" in error


def test_a_missing_interface_ends_the_instrument(startup_error):
    error = startup_error('interface = "socketcan"\nchannel = "can77"\n')
    assert error.startswith("pneuforce: CAN on socketcan can77 ")
