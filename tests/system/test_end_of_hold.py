"""Tests of the end of `pneuforce hold`, and of a vent, if the balloon may still be inflated."""

import json
import signal
import subprocess
import sys
from contextlib import contextmanager

import pytest

from pneuforce.instrument.cli.terminal.exit_codes import ExitCode
from pneuforce.sim.server.client import SimulatorClient
from tests.command_runner import pneuforce
from tests.system.waiting import wait_for


@contextmanager
def holding(stack):
    """Run `pneuforce hold 6 --json` until its first measurement, and kill it at the end."""
    words = ("hold", "6", "--json", "--port", str(stack.modbus_port))
    command = [sys.executable, "-m", "pneuforce", *words]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            process.stdout.readline()
            yield process
        finally:
            process.kill()


def ended(process):
    """Return the exit code and the last JSON line of the command."""
    last = json.loads(process.communicate(timeout=60)[0].splitlines()[-1])
    return process.returncode, last


def operate(stack, *words):
    done = pneuforce(*words, "--port", str(stack.modbus_port), "--json")
    return done.returncode, json.loads(done.stdout)


def test_a_blocked_tube_is_an_unconfirmed_vent_until_a_proof_test_passes_also_after_a_restart(stack):
    assert operate(stack, "vent")[1]["balloon_may_be_inflated"] is False
    with holding(stack) as process:
        SimulatorClient(stack.control.getpeername()[1]).request(fault={"name": "occluded"})
        process.terminate()
        code, last = ended(process)
    assert (code, last["code"], last["balloon_may_be_inflated"]) == (5, "vent_not_confirmed", True)
    assert last["fault"]["name"] == "occlusion"
    wait_for(lambda: operate(stack, "clear")[0], lambda code: code == ExitCode.DONE)
    for word in ("vent", "release"):
        assert_unproven(stack, word)
    stack.host.send(signal.SIGTERM)
    wait_for(lambda: stack.host.running, lambda running: not running)
    assert "exit code 5" in str(stack.host.failure())
    assert any("not verified: The tube was blocked" in line for line in stack.host.stderr_lines)
    stack.host.restart()
    stack.host.ready()
    assert_unproven(stack, "vent")


def assert_unproven(stack, word):
    code, result = operate(stack, word)
    assert (code, result["balloon_may_be_inflated"]) == (5, True)
    assert "tube_unproven" in result["message"]


@pytest.mark.parametrize("cause", ["trip", "lost"])
def test_a_hold_that_ends_without_a_verified_vent_ends_with_code_5(stack, cause):
    with holding(stack) as process:
        if cause == "trip":
            stack.unplug()
        else:
            stack.host.kill()
        code, last = ended(process)
    assert (code, last["exit_code"], last["balloon_may_be_inflated"]) == (5, 5, True)
    assert last["message"].startswith("THE BALLOON MAY BE INFLATED")
    assert ("link_lost" if cause == "trip" else "could not be sent") in last["message"]
