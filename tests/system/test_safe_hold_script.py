"""Tests of docs/examples/safe-hold.sh with the simulator: the balloon is vented however the script ends."""

import json
import os
import signal
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.source_tree import ROOT
from tests.system.waiting import wait_for

SCRIPT = ROOT / "docs/examples/safe-hold.sh"


@contextmanager
def running_script(stack):
    """Run the script as a user does. Its children are ended with it."""
    environment = {**os.environ, "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
    process = subprocess.Popen(
        [SCRIPT, "--port", str(stack.modbus_port)],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        with process:
            yield process
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)


@pytest.fixture
def inflated(stack):
    """Return a function that waits until the script has inflated the balloon."""
    plc = stack.plc()
    yield lambda: wait_for(plc.read, lambda values: values["state"] in ("inflating", "settling", "holding"))
    plc.close()


def assert_vented(stack):
    with stack.plc() as plc:
        assert "vented" in plc.read()["status"]
        assert plc.read()["lease_holder"] == "none"


def test_the_script_reads_the_force_and_vents_at_its_end(stack):
    with running_script(stack) as process:
        stdout, stderr = process.communicate(timeout=120)
    assert process.returncode == 0, stderr
    read = [json.loads(line) for line in stdout.splitlines()]
    assert len(read) == 5
    assert "holding" in {line["state"] for line in read}
    assert_vented(stack)


@pytest.mark.parametrize("sent", [signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_the_script_with_a_verified_vent(stack, inflated, sent):
    with running_script(stack) as process:
        inflated()
        process.send_signal(sent)
        _, stderr = process.communicate(timeout=120)
    assert (process.returncode, "Vented" in stderr) == (1, True), stderr
    assert_vented(stack)


def test_a_killed_hold_ends_the_script_with_an_error_and_a_vent(stack, inflated):
    with running_script(stack) as process:
        inflated()
        children = Path(f"/proc/{process.pid}/task/{process.pid}/children")
        [hold] = [
            int(child)
            for child in children.read_text().split()
            if b"hold" in Path(f"/proc/{child}/cmdline").read_bytes().split(b"\0")
        ]
        os.kill(hold, signal.SIGKILL)
        _, stderr = process.communicate(timeout=120)
    assert (process.returncode, "Vented" in stderr) == (1, True), stderr
