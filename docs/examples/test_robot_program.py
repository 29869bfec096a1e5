"""Test of a robot's force control loop, written here in Python, over CAN with a simulated rig."""

import subprocess
import sys
import time

import can
import cantools
import pytest

# The DBC file of the installed version, as pneuforce map --format dbc > pneuforce.dbc writes it.
MAP = [sys.executable, "-m", "pneuforce", "map", "--format", "dbc"]
DBC = cantools.database.load_string(subprocess.run(MAP, stdout=subprocess.PIPE, text=True, check=True).stdout)
FORCE = DBC.get_message_by_name("Force")
TARGET_N = 1.5
GAIN_MM_PER_S_N = 2.0
BACK_OFF_MM_PER_S = -5.0
TIMEOUT_S = 0.1


class Approach:
    """Admittance control: forward (+) if the force is too small, back (-) if too large or unknown."""

    def __init__(self, bus):
        self.bus = bus
        self.speed_mm_per_s = BACK_OFF_MM_PER_S

    def step(self):
        """Set the speed from the next Force frame. Without a frame within 0.1 s, the force is unknown."""
        deadline_s = time.monotonic() + TIMEOUT_S
        frame = self.bus.recv(TIMEOUT_S)
        while frame is not None and frame.arbitration_id != FORCE.frame_id:
            frame = self.bus.recv(max(0.0, deadline_s - time.monotonic()))
        values = {"force_valid": 0} if frame is None else DBC.decode_message(FORCE.frame_id, frame.data)
        self.speed_mm_per_s = (
            GAIN_MM_PER_S_N * (TARGET_N - values["force"]) if values["force_valid"] else BACK_OFF_MM_PER_S
        )


@pytest.fixture
def approach(pneuforce_rig):
    pneuforce_rig.inflate(6.0)
    with can.Bus(**pneuforce_rig.can_arguments) as bus:
        yield Approach(bus)


def step_until(approach, condition, seconds=5.0):
    deadline_s = time.monotonic() + seconds
    while not condition(approach.speed_mm_per_s):
        assert time.monotonic() < deadline_s, f"{approach.speed_mm_per_s} mm/s"
        approach.step()


def test_the_robot_moves_forward_to_the_target_force_and_back_from_a_larger_force(pneuforce_rig, approach):
    step_until(approach, lambda speed: speed == GAIN_MM_PER_S_N * TARGET_N)
    pneuforce_rig.press(TARGET_N)
    step_until(approach, lambda speed: abs(speed) < 0.2)
    pneuforce_rig.press(3.0)
    step_until(approach, lambda speed: -3.4 < speed < -2.6)


def test_the_robot_moves_back_when_the_force_is_invalid(pneuforce_rig, approach):
    step_until(approach, lambda speed: speed > 0.0)
    with pneuforce_rig.inject_fault("sensor_open"):
        step_until(approach, lambda speed: speed == BACK_OFF_MM_PER_S, seconds=2.0)
