"""Tests of the force control program: speeds, and a run on the simulated robot.

To use these tests in your project, copy force_control.py into the same folder: the tests import this program.
"""

import re
import subprocess
import sys
import time
from pathlib import Path

import force_control
import pytest

import pneuforce
from pneuforce import Measurement, Status

PROGRAM = Path(__file__).with_name("force_control.py")


@pytest.mark.parametrize(
    ("measurement", "speed"),
    [
        (Measurement(force_or_nan=0.0), 5.0),
        (Measurement(force_or_nan=1.4), 1.0),
        (Measurement(force_or_nan=1.5), 0.0),
        (Measurement(force_or_nan=9.0), -5.0),
        (Measurement(force_or_nan=1.85), -5.0),
        (Measurement(), -5.0),
        (Measurement(force_or_nan=0.0, status_or_none=frozenset({Status.FORCE_HIGH_ALARM})), -5.0),
    ],
    ids=[
        "free",
        "below",
        "at the target",
        "far above",
        "above the limit of the program",
        "not valid",
        "above the limit",
    ],
)
def test_the_speed_follows_the_error_and_is_negative_without_a_valid_force(measurement, speed):
    assert force_control.speed_mm_per_s(measurement) == pytest.approx(speed)


def test_the_program_holds_the_force_without_overshoot_and_then_vents(pneuforce_rig):
    program = subprocess.Popen(
        [sys.executable, PROGRAM, pneuforce_rig.url, "--control", str(pneuforce_rig.control_port)]
        + ["--seconds", "4"],
        stdout=subprocess.PIPE,
        text=True,
    )
    forces_n = []
    while program.poll() is None:
        forces_n.append(pneuforce_rig.truth()["force_n"])
        time.sleep(0.05)
    assert program.returncode == 0
    highest_n = float(re.search(r"highest force ([0-9.]+) N", program.stdout.read())[1])
    assert highest_n == pytest.approx(force_control.TARGET_N, rel=0.1)
    assert 0.95 * force_control.TARGET_N < max(forces_n) < 1.1 * force_control.TARGET_N
    assert forces_n[-1] == 0.0
    pneuforce_rig.wait_for(lambda registers: "vented" in registers["status"])


RDT_HOST = "127.0.0.83"


def wait_until(condition, program, seconds=15.0):
    until_s = time.monotonic() + seconds
    while not condition():
        assert program.poll() is None, program.stderr.read()
        assert time.monotonic() < until_s
        time.sleep(0.02)


@pytest.mark.pneuforce(instrument={"rdt": {"enabled": True, "host": RDT_HOST}})
def test_over_rdt_the_program_follows_the_alarm_and_the_end_of_the_hold(pneuforce_rig):
    def force_n():
        return pneuforce_rig.truth()["force_n"]

    control = ["--hold", pneuforce_rig.url, "--control", str(pneuforce_rig.control_port), "--seconds", "60"]
    program = subprocess.Popen(
        [sys.executable, PROGRAM, f"rdt://{RDT_HOST}", *control], stderr=subprocess.PIPE, text=True
    )
    wait_until(lambda: force_n() > 0.9 * force_control.TARGET_N, program)
    pneuforce_rig.write("force_limit", 1.0)
    wait_until(lambda: force_n() < 0.9, program, seconds=2.0)
    pneuforce_rig.write("mode", "vent")
    assert "no longer held" in program.communicate(timeout=10.0)[1]
    assert program.returncode == 1
    assert force_n() == 0.0


def test_a_force_limit_below_the_target_is_rejected_before_the_inflation(pneuforce_rig):
    pneuforce_rig.write("force_limit", 1.0)
    with (
        pneuforce.connect(pneuforce_rig.url) as holder,
        pytest.raises(pneuforce.ConfigurationError, match="not above the target"),
    ):
        force_control.check_limit(holder)
