"""Tests of the force control program: speeds, and a run on the simulated robot.

To use these tests in your project, copy force_control.py into the same folder: the tests import this program.
"""

import argparse
import re
import signal
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
    command = [sys.executable, PROGRAM, pneuforce_rig.url, "--control-port", str(pneuforce_rig.control_port)]
    forces_n = []
    with subprocess.Popen([*command, "--seconds", "4"], stdout=subprocess.PIPE, text=True) as program:
        while program.poll() is None:
            forces_n.append(pneuforce_rig.truth()["force_n"])
            time.sleep(0.05)
        output = program.stdout.read()
    assert program.returncode == 0
    highest_n = float(re.search(r"highest force ([0-9.]+) N", output)[1])
    assert highest_n == pytest.approx(force_control.TARGET_N, rel=0.1)
    assert 0.95 * force_control.TARGET_N < max(forces_n) < 1.1 * force_control.TARGET_N
    assert forces_n[-1] == 0.0
    pneuforce_rig.wait_for(lambda registers: "vented" in registers["status"])


@pytest.mark.parametrize("text", ["nan", "inf", "-1", "8 s"])
def test_a_duration_that_is_no_number_of_seconds_is_rejected(text):
    with pytest.raises(argparse.ArgumentTypeError, match="is not a duration"):
        force_control.duration_s(text)


def test_a_wrong_control_port_gives_one_sentence():
    for port in (1, 99_999_999):
        with pytest.raises(force_control.RobotError, match="there is no robot"):
            force_control.SimulatedRobot(port)


def wait_until(condition, program, seconds=15.0):
    until_s = time.monotonic() + seconds
    while not condition():
        assert program.poll() is None, program.stderr.read()
        assert time.monotonic() < until_s
        time.sleep(0.02)


def leave_pressing_robot(rig):
    """Leave a robot that presses, as a program that was killed."""
    with force_control.SimulatedRobot(rig.control_port, distance_mm=0.0) as robot:
        for _ in range(10):
            robot.move(5.0)
            time.sleep(0.05)


def start_program(rig, *arguments, stdout=None):
    command = [sys.executable, PROGRAM, rig.url, "--control", str(rig.control_port), *arguments]
    return subprocess.Popen(command, stdout=stdout, stderr=subprocess.PIPE, text=True)


def test_the_program_moves_a_pressing_robot_away_first_and_ends_quietly_without_a_reader(pneuforce_rig):
    leave_pressing_robot(pneuforce_rig)
    with start_program(pneuforce_rig, "--seconds", "0", stdout=subprocess.PIPE) as program:
        program.stdout.close()
        assert program.stderr.read() == ""
        assert program.wait(60) == 1
    assert pneuforce_rig.read()["active_fault_count"] == 0


def test_ctrl_c_moves_back_even_if_it_is_pressed_twice(pneuforce_rig):
    program = start_program(pneuforce_rig, "--seconds", "60", "--no-proof-tests")
    wait_until(lambda: pneuforce_rig.truth()["force_n"] > 0.5, program)
    assert pneuforce_rig.read()["proof_test"] == "forbidden"
    for _ in range(2):
        program.send_signal(signal.SIGINT)
        time.sleep(0.3)
    assert program.communicate(timeout=60)[1] == "ended by SIGINT\n"
    assert program.returncode == 1
    assert pneuforce_rig.truth()["force_n"] == 0.0
    pneuforce_rig.wait_for(lambda registers: registers["lease_holder"] == "none")


RDT_HOST = "127.0.0.83"


@pytest.mark.pneuforce(instrument={"rdt": {"enabled": True, "host": RDT_HOST}})
def test_over_rdt_the_program_follows_the_alarm_and_the_end_of_the_hold(pneuforce_rig):
    def force_n():
        return pneuforce_rig.truth()["force_n"]

    control = [
        "--hold",
        pneuforce_rig.url,
        "--control-port",
        str(pneuforce_rig.control_port),
        "--seconds",
        "60",
    ]
    program = subprocess.Popen(
        [sys.executable, PROGRAM, f"rdt://{RDT_HOST}", *control], stderr=subprocess.PIPE, text=True
    )
    wait_until(lambda: force_n() > 0.9 * force_control.TARGET_N, program)
    pneuforce_rig.write("force_limit", 1.0)
    wait_until(lambda: force_n() < 0.9, program, seconds=2.0)
    pneuforce_rig.write("mode", "vent")
    assert "no longer held" in program.communicate(timeout=60)[1]
    assert program.returncode == 1
    assert force_n() == 0.0


def test_a_force_limit_below_the_target_is_rejected_before_the_inflation(pneuforce_rig):
    pneuforce_rig.write("force_limit", 1.0)
    with (
        pneuforce.connect(pneuforce_rig.url) as holder,
        pytest.raises(pneuforce.ConfigurationError, match="not above the target"),
    ):
        force_control.check_limit(holder)
