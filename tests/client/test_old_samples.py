"""Tests that a sample which has become old meanwhile is never shown as a valid force."""

import signal
import subprocess
import sys
import time

import pytest

import pneuforce
from pneuforce.client.latest_sample import LatestSample
from pneuforce.client.measurement import Measurement
from pneuforce.testing import simulated_rig
from pneuforce.teststand.stack import free_port

PROGRAM = """
import sys, time, pneuforce
with pneuforce.connect(sys.argv[1]) as sensor:
    for measurement in sensor.stream(timeout_s=5.0):
        print(time.monotonic(), measurement.force_or_nan, flush=True)
"""


@pytest.fixture(scope="module")
def rig():
    port = free_port()
    with simulated_rig(instrument={"rdt": {"enabled": True, "port": port}}) as running:
        running.urls = {"tcp": running.url, "can": running.can_url, "rdt": f"rdt://127.0.0.1:{port}"}
        yield running


@pytest.fixture
def pressed(rig):
    """Return the rig with a pressed balloon."""
    with pneuforce.connect(rig.url) as sensor:
        sensor.clear()
        with sensor.hold(6.5, lease_s=60.0):
            rig.press(1.5)
            yield rig
            rig.release()


@pytest.mark.parametrize("bus", ["tcp", "can", "rdt"])
def test_the_last_sample_before_a_silence_is_not_valid_after_a_slow_loop_body(pressed, bus):
    with pneuforce.connect(pressed.urls[bus]) as sensor:
        samples = sensor.stream()
        assert any(next(samples).valid for _ in range(20))
        time.sleep(0.05)  # further samples arrive
        with pressed.pause_instrument():
            time.sleep(0.2)  # less than the time after which the board vents
            late = next(samples)
        assert not late.valid
        assert late.sample_counter is None


def test_the_age_of_a_sample_includes_the_time_until_it_was_taken():
    slot = LatestSample()
    slot.put(Measurement(force_or_nan=1.0, sample_counter=7, age_s=0.01))
    time.sleep(0.05)
    sample = slot.wait_for_new(None, 0.0, 10.0)
    assert 0.06 <= sample.age_s < 10.0
    assert slot.wait_for_new(None, 0.0, 0.05) is None
    assert slot.wait_for_new(7, 0.0, 10.0) is None


@pytest.mark.parametrize(("bus", "stop_s"), [("tcp", 1.0), ("can", 5.0), ("rdt", 1.0)])
def test_a_program_that_was_stopped_gets_no_force_of_that_time(pressed, bus, stop_s):
    """The hub and the system keep the data of seconds. Most of it contains the force before the release."""
    command = [sys.executable, "-c", PROGRAM, pressed.urls[bus]]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as program:
        for _ in range(50):
            program.stdout.readline()
        program.send_signal(signal.SIGSTOP)
        time.sleep(stop_s)
        pressed.release()
        continued_s = time.monotonic()
        program.send_signal(signal.SIGCONT)
        time.sleep(1.0)
        program.kill()
        lines = [line.split() for line in program.stdout.read().splitlines() if len(line.split()) == 2]
    forces_n = [float(force) for at_s, force in lines if float(at_s) > continued_s]
    assert [force_n for force_n in forces_n if force_n > 0.3] == []
    assert any(force_n < 0.3 for force_n in forces_n)
