"""Force control with a simulated robot: approach tissue at 5 mm/s, hold 1.5 N, and move back.

    python force_control.py tcp://127.0.0.1:5020 --control-port 45123
    python force_control.py "can://socketcand/can0?host=127.0.0.1&port=29536" --control-port 45123
    python force_control.py rdt://127.0.0.1 --hold tcp://127.0.0.1:5020 --control-port 45123

The control port is that of the simulator (`make run` shows it). For a real robot, replace `SimulatedRobot`.
docs/how-to/force-control.md describes the program.
"""

import argparse
import contextlib
import json
import math
import os
import signal
import socket
import sys
import time

import pneuforce

TARGET_N = 1.5
FORCE_LIMIT_N = 1.8  # limit of this program, because not every bus transmits the force alarm
WATCH_PERIOD_S = 0.1
GAIN_MM_PER_S_N = 10.0  # gain × stiffness of the contact × delay: below 0.3, see docs/how-to/force-control.md
MAX_SPEED_MM_PER_S = 5.0
BACK_OFF_MM_PER_S = -5.0
MAX_FALL_N_PER_S, FALL_N = 1.0, 0.1  # after a faster and larger fall of the force, do not move forward


def speed_mm_per_s(measurement):
    """Return the speed of the robot: forward (+) if the force is too small, else back (-).

    The robot also moves back if the force is not valid, or above the limit of this program or of the
    instrument. RDT does not transmit the status, so there only the limit of this program applies.
    """
    if not measurement.valid or measurement.force_n > FORCE_LIMIT_N:
        return BACK_OFF_MM_PER_S
    if pneuforce.Status.FORCE_HIGH_ALARM in (measurement.status_or_none or ()):
        return BACK_OFF_MM_PER_S
    speed = GAIN_MM_PER_S_N * (TARGET_N - measurement.force_n)
    return max(-MAX_SPEED_MM_PER_S, min(MAX_SPEED_MM_PER_S, speed))


class FallDetector:
    """Detector of a force that falls as after a burst of the balloon, when the force is valid at first.

    It compares the force with a reference, which is never below the force and falls by at most 1 N/s.
    """

    def __init__(self):
        self._reference_n, self._seen_s = 0.0, -math.inf

    def falls(self, force_n, now_s):
        """Return True if the force [N] is more than 0.1 N below the reference: do not move forward."""
        self._reference_n = max(force_n, self._reference_n - MAX_FALL_N_PER_S * (now_s - self._seen_s))
        self._seen_s = now_s
        return force_n < self._reference_n - FALL_N


class RobotError(Exception):
    """Error for a robot that cannot be commanded."""


class SimulatedRobot:
    """Robot of the simulator. It moves the balloon along its axis.

    It stops if no speed arrives for 0.2 s. All methods raise RobotError if the robot cannot be commanded.
    """

    def __init__(self, control_port, **start):
        """Take the balloon, and move it to its free position. A real robot must move there at this point.

        `start` can contain `distance_mm`, the distance from the tissue, and `tissue`.
        """
        try:
            self._connection = socket.create_connection(("127.0.0.1", control_port))
        except (OSError, OverflowError) as error:
            raise RobotError(
                f"there is no robot at the control port {control_port}: {error}; `make run` shows the port"
            ) from None
        self._send(robot=start)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._connection.close()

    def move(self, speed_mm_per_s):
        """Set the speed."""
        self._send(speed_mm_per_s=speed_mm_per_s)

    def _send(self, **request):
        try:
            self._connection.sendall(json.dumps(request).encode() + b"\n")
        except OSError as error:
            raise RobotError(f"the robot is lost: {error}; check that the simulator runs") from None


def check_limit(holder):
    """Raise ConfigurationError if the force limit of the instrument is not above the target.

    Over CAN, the limit of the instrument is unknown, but each frame transmits the force alarm.
    """
    limit_n = holder.details().force_limit_n
    if limit_n is not None and limit_n <= TARGET_N:
        raise pneuforce.ConfigurationError(
            f"the force limit of the instrument is {limit_n:g} N, not above the target of {TARGET_N:g} N: "
            "choose a smaller target, or a higher limit (register 514)"
        )


def control(sensor, holder, robot, seconds):
    """Control the force for a time. Return the highest measured force [N].

    The stream raises an error when the hold ends, but only if `sensor` also holds the balloon. Therefore
    another holder is read periodically. Its alarm applies, too.
    """
    highest_n, end_s, watched_s, alarm = 0.0, time.monotonic() + seconds, -WATCH_PERIOD_S, False
    fall_detector = FallDetector()
    for measurement in sensor.stream():
        now_s = time.monotonic()
        speed = BACK_OFF_MM_PER_S if alarm else speed_mm_per_s(measurement)
        if measurement.valid and fall_detector.falls(measurement.force_n, now_s):
            speed = min(speed, 0.0)
        robot.move(speed)
        if holder is not sensor and now_s >= watched_s + WATCH_PERIOD_S:
            watched_s = now_s
            alarm = pneuforce.Status.FORCE_HIGH_ALARM in holder.read().status
        if measurement.valid:
            highest_n = max(highest_n, measurement.force_n)
        if now_s > end_s:
            break
    return highest_n


def move_back(robot, seconds=3.0):
    """Move away from the tissue for a time."""
    end_s = time.monotonic() + seconds
    while time.monotonic() < end_s:
        robot.move(BACK_OFF_MM_PER_S)
        time.sleep(0.05)


def duration_s(text):
    """Return a duration [s]. Raises ArgumentTypeError for NaN, and for an infinite or negative number."""
    with contextlib.suppress(ValueError):
        if 0 <= (value := float(text)) < math.inf:
            return value
    raise argparse.ArgumentTypeError(f"{text} is not a duration: write a number of seconds, 0 or more")


def ignore_signals():
    """Ignore SIGINT and SIGTERM, so that a second Ctrl-C does not end the movement back and the vent."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("url", help="connection that measures the force")
    parser.add_argument("--hold", help="connection that inflates the balloon; by default, url")
    parser.add_argument("--setpoint", type=float, default=8.0, help="pressure of the balloon [kPa]")
    parser.add_argument("--control-port", type=int, required=True, help="control port of the simulator")
    parser.add_argument("--seconds", type=duration_s, default=8.0, help="duration of the control")
    parser.add_argument("--no-proof-tests", action="store_true", help="forbid proof tests during the hold")
    options = parser.parse_args()
    for number in (signal.SIGINT, signal.SIGTERM):  # so that `finally` is executed
        signal.signal(number, lambda number, _: sys.exit(f"ended by {signal.Signals(number).name}"))
    with contextlib.ExitStack() as stack:
        sensor = stack.enter_context(pneuforce.connect(options.url))
        holder = stack.enter_context(pneuforce.connect(options.hold)) if options.hold else sensor
        check_limit(holder)
        # First the free position: after a kill of this program, the robot can still press, and a contact
        # during the inflation trips the rig.
        tissue = {"law": "hertz", "modulus_kpa": 20.0}
        robot = stack.enter_context(SimulatedRobot(options.control_port, distance_mm=5.0, tissue=tissue))
        proof_tests = not options.no_proof_tests
        stack.enter_context(holder.hold(options.setpoint, lease_s=1.0, proof_tests=proof_tests))
        try:
            print(f"highest force {control(sensor, holder, robot, options.seconds):.3f} N", flush=True)
        finally:  # the robot must move away also if the hold has ended, or the connection is lost
            ignore_signals()
            move_back(robot)


if __name__ == "__main__":
    try:
        main()
    except (pneuforce.PneuforceError, RobotError) as error:
        sys.exit(str(error))
    except BrokenPipeError:  # the program that reads the output has ended
        os.dup2(
            os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno()
        )  # the text is flushed again at the exit
        sys.exit(1)
