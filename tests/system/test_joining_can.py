"""An instrument joins its CAN bus while it already serves Modbus; where it may not, it ends in a sentence."""

import subprocess
import sys

import pytest

from tests.system.waiting import wait_for


@pytest.fixture
def refused(tmp_path, stack):
    """What an instrument on a rig of its own says that ends because of this [can] table."""
    link = tmp_path / "other"
    stack.plug_in(link)

    def run(table):
        off = '[modbus]\nenabled = false\n[events]\nfile = ""\n'
        configuration = f'[rig]\nport = "{link}"\n{off}[can]\nenabled = true\n{table}'
        done = subprocess.run(
            [sys.executable, "-m", "instrument", "run", "--config", "/dev/stdin"],
            input=configuration,
            capture_output=True,
            text=True,
            timeout=20,
            check=False,
        )
        assert (done.returncode, done.stdout) == (2, "")
        return done.stderr.splitlines()[-1]

    return run


@pytest.mark.parametrize("mode", ["raw", "canopen"])
def test_a_node_id_that_another_instrument_uses_is_not_taken(stack, refused, mode):
    with stack.plc() as plc:
        wait_for(plc.read, lambda registers: "can_down" not in registers["status"])
    said = refused(f'mode = "{mode}"\ninterface = "socketcand"\nport = {stack.can_port}\n')
    assert said.startswith("pneuforce: CAN node id 5 is taken on socketcand can0 at 127.0.0.1:")


def test_an_interface_that_is_not_there_ends_the_instrument(refused):
    said = refused('interface = "socketcan"\nchannel = "can77"\n')
    assert said.startswith("pneuforce: CAN on socketcan can77 cannot be opened: ")
