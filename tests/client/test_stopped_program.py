"""Tests of a program that is stopped for a time during a hold, as by a debugger or a frozen container."""

import signal
import subprocess
import sys
import time

import pytest

import pneuforce
from pneuforce.testing import simulated_rig

PROGRAM = """
import sys, time, pneuforce
with pneuforce.connect(sys.argv[1]) as sensor, sensor.hold(5.0, lease_s=float(sys.argv[2])):
    print("held", flush=True)
    until_s = time.monotonic() + 6.0
    try:
        for measurement in sensor.stream():
            if time.monotonic() > until_s:
                print("held until the end")
                break
    except pneuforce.PneuforceError as error:
        print(type(error).__name__, error)
"""


@pytest.fixture(scope="module")
def rig():
    with simulated_rig() as running:
        yield running


def stopped(url, lease_s, pause_s):
    """Run the program, stop it for a time while it holds the balloon, and return its last line."""
    command = [sys.executable, "-c", PROGRAM, url, str(lease_s)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as program:
        assert program.stdout.readline() == "held\n"
        time.sleep(1.0)
        program.send_signal(signal.SIGSTOP)
        time.sleep(pause_s)
        program.send_signal(signal.SIGCONT)
        return program.communicate(timeout=60)[0]


@pytest.mark.parametrize("bus", ["url", "can_url"])
def test_a_hold_continues_if_its_program_was_stopped_for_less_than_the_lease(rig, bus):
    assert stopped(getattr(rig, bus), 20.0, 2.5) == "held until the end\n"


@pytest.mark.parametrize("bus", ["url", "can_url"])
def test_a_lease_that_has_expired_meanwhile_is_reported_as_a_trip(rig, bus):
    output = stopped(getattr(rig, bus), 1.0, 3.0)
    with pneuforce.connect(rig.url) as sensor:
        sensor.clear()
    assert output.startswith("Tripped the rig has tripped (lease_expired)")
