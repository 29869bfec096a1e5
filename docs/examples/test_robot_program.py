"""Test of a robot's force control loop, written here in Python, over CAN with a simulated rig."""

import math
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
MAX_AGE_S = 0.1
WAIT_S = 0.02


class Approach:
    """Admittance control: forward (+) if the force is too small, back (-) if too large or unknown.

    The speed is also back while the instrument reports a force above its limit.
    """

    def __init__(self, bus):
        self.bus = bus
        self.speed_mm_per_s = BACK_OFF_MM_PER_S
        self._values = {"force_valid": 0, "counter": None}
        self._received_s = -math.inf

    def step(self):
        """Set the speed from the last waiting Force frame. The other waiting frames are old.

        A frame with an unchanged counter is ignored, because a gateway has repeated it. The force is unknown
        if no new frame has arrived for 0.1 s.
        """
        frame = self.bus.recv(WAIT_S)
        while frame is not None:
            if frame.arbitration_id == FORCE.frame_id:
                self._take(DBC.decode_message(FORCE.frame_id, frame.data))
            frame = self.bus.recv(0.0)
        is_new = time.monotonic() - self._received_s <= MAX_AGE_S
        if is_new and self._values["force_valid"] and not self._values["force_high_alarm"]:
            self.speed_mm_per_s = GAIN_MM_PER_S_N * (TARGET_N - self._values["force"])
        else:
            self.speed_mm_per_s = BACK_OFF_MM_PER_S

    def _take(self, values):
        if values["counter"] != self._values["counter"]:
            self._values, self._received_s = values, time.monotonic()


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
    pneuforce_rig.press(2.0)
    step_until(approach, lambda speed: -1.4 < speed < -0.6)


def test_the_robot_moves_back_when_the_force_is_invalid(pneuforce_rig, approach):
    step_until(approach, lambda speed: speed > 0.0)
    with pneuforce_rig.inject_fault("sensor_open"):
        step_until(approach, lambda speed: speed == BACK_OFF_MM_PER_S, seconds=2.0)


def test_a_slow_control_cycle_acts_on_the_latest_force(pneuforce_rig, approach):
    """A cycle of 50 ms receives five Force frames, so a program that takes one of them falls behind."""
    for _ in range(40):
        time.sleep(0.05)
        approach.step()
    assert approach.speed_mm_per_s == GAIN_MM_PER_S_N * TARGET_N
    pneuforce_rig.press(2.0)  # returns when the force has been constant for 0.6 s
    approach.step()
    assert approach.speed_mm_per_s < -0.6  # BACK_OFF_MM_PER_S if this process had to wait for a processor


def test_the_robot_moves_back_during_the_force_alarm(pneuforce_rig, approach):
    pneuforce_rig.write("force_limit", 1.0)
    step_until(approach, lambda speed: speed > 0.0)
    pneuforce_rig.press(1.3)  # below the target of the loop
    step_until(approach, lambda speed: speed == BACK_OFF_MM_PER_S, seconds=1.0)


def force_frame(counter, force_mn=500):
    """Return a valid Force frame."""
    data = force_mn.to_bytes(2, "little") + bytes(4) + bytes((0x82, counter))
    return can.Message(arbitration_id=FORCE.frame_id, data=data, is_extended_id=False)


def test_repeated_frames_do_not_keep_the_force_valid():
    with can.Bus("repeated", "virtual") as robot, can.Bus("repeated", "virtual") as gateway:
        approach = Approach(robot)
        for counter, speed in ((7, 2.0), (7, BACK_OFF_MM_PER_S), (8, 2.0)):
            gateway.send(force_frame(counter))
            approach.step()
            assert approach.speed_mm_per_s == speed
            time.sleep(2 * MAX_AGE_S)
