"""Force control loop of a robot on the CAN frames of pneuforce, with python-can, cantools and the DBC file.

    python robot_listener.py                                  # listens on can0
    python robot_listener.py --setpoint 8.0                   # inflates and renews the lease; Ctrl-C vents
    python robot_listener.py --interface socketcand --host 127.0.0.1 --port 29536      # with `make run`

robot_listener.cpp is the same program in C++. docs/robot.md describes both programs.
"""

import argparse
import math
import signal
import sys
import time
from pathlib import Path
from typing import NamedTuple

import can
import cantools

DBC = cantools.database.load_file(Path(__file__).parents[1] / "pneuforce.dbc")
FORCE, ANSWER, COMMAND = (DBC.get_message_by_name(name) for name in ("Force", "Answer", "Command"))
MAX_AGE_S = 0.1  # ten periods at 100 Hz: one frame may be lost, but an old force must not be used
LEASE_S, RETRY_S = 1.0, 0.1
TARGET_N, GAIN_MM_PER_S_N, BACK_OFF_MM_PER_S = 1.5, 2.0, -5.0


class Reading(NamedTuple):
    """Value with its validity. `valid` is True if the value may be used."""

    value: float = math.nan
    valid: bool = False


class ForceInput:
    """Latest force for a control loop, with the checks that make it valid."""

    def __init__(self):
        self.lost = 0
        self._last = None
        self._received_s = -math.inf

    def take(self, frame, now_s):
        """Store a Force frame. A frame with an unchanged counter is ignored: a gateway has repeated it."""
        before, self._last = self._last, frame
        if before is None or frame["counter"] != before["counter"]:
            self.lost += (frame["counter"] - before["counter"] - 1) % 256 if before else 0
            self._received_s = now_s

    def force(self, now_s):
        """Return the force [N].

        The receiver checks the age of the force, because a stopped sender cannot report an error.
        """
        last = self._last
        if last is None or now_s - self._received_s > MAX_AGE_S or not last["force_valid"]:
            return Reading()
        force_n = last["force"]  # a float, or the name of the code for "not available"
        return Reading(force_n, True) if isinstance(force_n, float) else Reading()

    @property
    def above_limit(self):
        """Return True if the last frame reports a force above the force limit."""
        return bool(self._last and self._last["force_high_alarm"])


def speed_mm_per_s(force_input, now_s):
    """Return the speed of an admittance control: forward (+) if the force is too small, else back (-).

    The robot also moves back if the force is unknown.
    """
    force = force_input.force(now_s)
    if not force.valid or force_input.above_limit:
        return BACK_OFF_MM_PER_S
    return GAIN_MM_PER_S_N * (TARGET_N - force.value)


class Inflation:
    """Sequence of Commands that inflates the balloon and renews the lease.

    The Command vent is repeated until its Answer arrives, then the Command hold until its Answer arrives.
    After that, the Command hold is repeated to renew the lease.
    """

    def __init__(self, setpoint_kpa):
        self.rejected = None
        self._setpoint_kpa = setpoint_kpa
        # A number that differs after a restart of the program: the instrument rejects a hold that it already
        # had before the last vent.
        self._mode, self._sequence, self._wait_s = "vent", time.time_ns() // 1_000_000 % 256, RETRY_S
        self._next_s = -math.inf

    def due(self, now_s):
        """Return the Command to send now, or None."""
        if now_s < self._next_s:
            return None
        self._next_s = now_s + self._wait_s
        return self._command(self._mode, self._setpoint_kpa, LEASE_S)

    def take(self, answer):
        """Handle an Answer frame."""
        if answer["sequence"] != self._sequence:
            return
        if answer["result"] not in ("accepted", "renewed"):
            self.rejected = str(answer["result"])  # do not retry: a person must first remove the cause
        elif self._mode == "vent":
            self._mode, self._next_s = "hold", -math.inf
            self._sequence = (self._sequence + 1) % 256
        else:
            self._wait_s = LEASE_S / 3

    def vent_and_release(self):
        """Return the Command that vents and releases the lease. A lease that expires trips the rig."""
        self._sequence = (self._sequence + 1) % 256
        return self._command("vent", 0.0, 0.0)

    def _command(self, mode, setpoint_kpa, lease_s):
        values = {"mode": mode, "setpoint": setpoint_kpa, "lease": lease_s, "sequence": self._sequence}
        return can.Message(
            arbitration_id=COMMAND.frame_id,
            data=COMMAND.encode(values | {"proof_test": "allowed"}),
            is_extended_id=False,
        )


def run(bus, inflation, stopped):
    force_input, printed_mm_per_s = ForceInput(), None
    while not stopped and not (inflation and inflation.rejected):
        frame = bus.recv(0.02)
        while frame is not None:  # after a pause, many frames wait: only the last force is new
            if frame.arbitration_id == FORCE.frame_id:
                force_input.take(FORCE.decode(frame.data), time.monotonic())
            elif frame.arbitration_id == ANSWER.frame_id and inflation:
                inflation.take(ANSWER.decode(frame.data))
            frame = bus.recv(0)
        now_s = time.monotonic()
        speed = speed_mm_per_s(force_input, now_s)
        if speed != printed_mm_per_s:
            force = force_input.force(now_s)
            printed_mm_per_s = speed
            print(
                f"force {force.value:.3f} N, valid {force.valid}: {speed:+.3f} mm/s, {force_input.lost} lost"
            )
        command = inflation.due(now_s) if inflation else None
        if command is not None:
            bus.send(command)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--interface", default="socketcan", help="python-can interface")
    parser.add_argument("--channel", default="can0", help="channel of the interface")
    parser.add_argument("--host", help="socketcand only: address of the server")
    parser.add_argument("--port", type=int, help="socketcand only: TCP port of the server")
    parser.add_argument("--setpoint", type=float, help="kPa; without a setpoint, nothing is sent")
    options = parser.parse_args()
    server = {"host": options.host, "port": options.port, "tcp_tune": True} if options.host else {}
    stopped = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stopped.append(True))
    inflation = Inflation(options.setpoint) if options.setpoint else None
    with can.Bus(interface=options.interface, channel=options.channel, **server) as bus:
        try:
            run(bus, inflation, stopped)
        finally:
            if inflation:
                bus.send(inflation.vent_and_release())
    if inflation and inflation.rejected:
        sys.exit(f"The Command was rejected with {inflation.rejected}. See the results in docs/robot.md")


if __name__ == "__main__":
    main()
