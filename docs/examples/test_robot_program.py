"""A robot's force loop, here a few lines of Python, tested over CAN against pneuforce on a simulated rig."""

import time
from pathlib import Path

import can
import cantools
import pytest

DBC = cantools.database.load_file(Path(__file__).parents[1] / "pneuforce.dbc")
FORCE = DBC.get_message_by_name("Force")
WANTED_N = 1.5
GAIN_MM_PER_S_N = 2.0
BACK_OFF_MM_PER_S = -5.0
SILENT_S = 0.1


class Approach:
    """An admittance: drives on (+) while the force is too small, back (-) while too great or unknown."""

    def __init__(self, bus):
        self.bus = bus
        self.speed_mm_per_s = BACK_OFF_MM_PER_S

    def step(self):
        """Take the next Force frame; silence is no force."""
        end_s = time.monotonic() + SILENT_S
        frame = self.bus.recv(SILENT_S)
        while frame is not None and frame.arbitration_id != FORCE.frame_id:
            frame = self.bus.recv(max(0.0, end_s - time.monotonic()))
        told = {"force_valid": 0} if frame is None else DBC.decode_message(FORCE.frame_id, frame.data)
        self.speed_mm_per_s = (
            GAIN_MM_PER_S_N * (WANTED_N - told["force"]) if told["force_valid"] else BACK_OFF_MM_PER_S
        )


@pytest.fixture
def approach(pneuforce_rig):
    pneuforce_rig.inflate(6.0)
    with can.Bus(**pneuforce_rig.can) as bus:
        yield Approach(bus)


def until(approach, wanted, seconds=5.0):
    end_s = time.monotonic() + seconds
    while not wanted(approach.speed_mm_per_s):
        assert time.monotonic() < end_s, f"{approach.speed_mm_per_s} mm/s"
        approach.step()


def test_it_drives_on_until_the_force_is_the_wanted_one_and_yields_to_a_greater(pneuforce_rig, approach):
    until(approach, lambda speed: speed == GAIN_MM_PER_S_N * WANTED_N)
    pneuforce_rig.press(WANTED_N)
    until(approach, lambda speed: abs(speed) < 0.2)
    pneuforce_rig.press(3.0)
    until(approach, lambda speed: -3.4 < speed < -2.6)


def test_it_backs_off_as_soon_as_the_force_is_not_valid(pneuforce_rig, approach):
    until(approach, lambda speed: speed > 0.0)
    with pneuforce_rig.fault("sensor_open"):
        until(approach, lambda speed: speed == BACK_OFF_MM_PER_S, seconds=2.0)
