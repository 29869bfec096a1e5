"""Test of docs/examples/force_control.py: the robot is not pushed forward after a burst of the balloon."""

import threading
import time

import pytest

import pneuforce
from pneuforce.testing import simulated_rig
from tests.bench.force_control import load_example

TARGET_N = 1.5


def test_a_slow_fall_is_no_burst_and_a_fast_fall_is():
    detector = load_example().FallDetector()
    assert not any(detector.falls(TARGET_N - 0.9 * n / 100, n / 100) for n in range(100))  # 0.9 N/s
    assert detector.falls(0.0, 1.0)
    assert detector.falls(0.0, 1.4)
    assert not detector.falls(0.0, 2.0)  # the force may be 0 N: the robot can approach again


def test_after_a_burst_the_robot_is_hardly_moved_forward_until_the_trip():
    example = load_example()
    moves = []

    class WatchedRobot(example.SimulatedRobot):
        def move(self, speed_mm_per_s):
            moves.append((time.monotonic(), speed_mm_per_s))
            super().move(speed_mm_per_s)

    with simulated_rig(instrument={"can": {"force_rate_hz": 500}}) as rig:
        burst_s = []

        def burst():
            burst_s.append(time.monotonic())
            rig.inject_fault("burst")

        with (
            pneuforce.connect(rig.can_url) as sensor,
            sensor.hold(8.0, lease_s=1.0, proof_tests=False),
            WatchedRobot(rig.control_port, distance_mm=5.0) as robot,
        ):
            timer = threading.Timer(5.0, burst)
            timer.start()
            with pytest.raises(pneuforce.Tripped, match="burst"):
                example.control(sensor, sensor, robot, 20.0)
    held = [speed for t_s, speed in moves if burst_s[0] - 1.0 < t_s < burst_s[0]]
    assert max(map(abs, held)) < 1.0  # the force was controlled
    after = [speed for t_s, speed in moves if t_s > burst_s[0]]
    # Until the force has fallen by 0.1 N, the speed is at most gain × 0.1 N, and noise.
    assert max(after) < 1.0 + 0.5
