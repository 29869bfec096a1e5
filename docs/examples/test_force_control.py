"""Tests of the force control program: speeds, and a run on the simulated robot."""

import re
import subprocess
import sys
import time
from pathlib import Path

import force_control
import pytest

from pneuforce import Measurement, Status

PROGRAM = Path(__file__).with_name("force_control.py")


@pytest.mark.parametrize(
    ("measurement", "speed"),
    [
        (Measurement(force_or_nan=0.0), 5.0),
        (Measurement(force_or_nan=1.4), 1.0),
        (Measurement(force_or_nan=1.5), 0.0),
        (Measurement(force_or_nan=9.0), -5.0),
        (Measurement(), -5.0),
        (Measurement(force_or_nan=0.0, status_or_none=frozenset({Status.FORCE_HIGH_ALARM})), -5.0),
    ],
    ids=["free", "below", "at the target", "far above", "not valid", "above the limit"],
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
