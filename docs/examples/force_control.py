"""Force control with a simulated robot: approach tissue at 5 mm/s, hold 1.5 N, and move back.

    python force_control.py tcp://127.0.0.1:5020 --control 45123
    python force_control.py "can://socketcand/can0?host=127.0.0.1&port=29536" --control 45123
    python force_control.py rdt://127.0.0.1 --hold tcp://127.0.0.1:5020 --control 45123

The control port is that of the simulator (`make run` shows it). For a real robot, replace `SimulatedRobot`.
docs/how-to/force-control.md describes the program.
"""

import argparse
import contextlib
import json
import signal
import socket
import sys
import time

import pneuforce

TARGET_N = 1.5
FORCE_LIMIT_N = 1.8  # limit of this program, because not every bus transmits the force alarm
WATCH_PERIOD_S = 0.1
GAIN_MM_PER_S_N = 10.0  # gain × stiffness of the contact × delay must stay below 0.3
MAX_SPEED_MM_PER_S = 5.0
BACK_OFF_MM_PER_S = -5.0


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


class SimulatedRobot:
    """Robot of the simulator. It moves the balloon along its axis.

    It stops if no speed arrives for 0.2 s.
    """

    def __init__(self, control_port, **start):
        """Take the balloon. `start` can contain `distance_mm` and `tissue`."""
        self._connection = socket.create_connection(("127.0.0.1", control_port))
        self._send(robot=start)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._connection.close()

    def move(self, speed_mm_per_s):
        """Set the speed."""
        self._send(speed_mm_per_s=speed_mm_per_s)

    def _send(self, **request):
        self._connection.sendall(json.dumps(request).encode() + b"\n")


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
    for measurement in sensor.stream():
        robot.move(BACK_OFF_MM_PER_S if alarm else speed_mm_per_s(measurement))
        now_s = time.monotonic()
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


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("url", help="connection that measures the force")
    parser.add_argument("--hold", help="connection that inflates the balloon; by default, url")
    parser.add_argument("--setpoint", type=float, default=8.0, help="pressure of the balloon [kPa]")
    parser.add_argument("--control", type=int, required=True, help="control port of the simulator")
    parser.add_argument("--seconds", type=float, default=8.0, help="duration of the control")
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("ended by SIGTERM"))  # so that `finally` is executed
    with contextlib.ExitStack() as stack:
        sensor = stack.enter_context(pneuforce.connect(options.url))
        holder = stack.enter_context(pneuforce.connect(options.hold)) if options.hold else sensor
        check_limit(holder)
        stack.enter_context(holder.hold(options.setpoint, lease_s=1.0))
        tissue = {"law": "hertz", "modulus_kpa": 20.0}
        robot = stack.enter_context(SimulatedRobot(options.control, distance_mm=5.0, tissue=tissue))
        try:
            print(f"highest force {control(sensor, holder, robot, options.seconds):.3f} N")
        finally:  # the robot must move away also if the hold has ended, or the connection is lost
            move_back(robot)


if __name__ == "__main__":
    try:
        main()
    except pneuforce.PneuforceError as error:
        sys.exit(str(error))
