"""Force control loop of a robot on the CAN frames of pneuforce, with python-can, cantools and the DBC file.

    python robot_listener.py                                  # listens on can0
    python robot_listener.py --setpoint 8.0                   # inflates and renews the lease; Ctrl-C vents
    python robot_listener.py --interface socketcand --host 127.0.0.1 --port 29536      # with `make run`

robot_listener.cpp is the same program in C++. docs/robot.md describes both programs.
"""

import argparse
import logging
import math
import os
import signal
import socket
import sys
import time
from pathlib import Path
from typing import NamedTuple

import can
import cantools

DBC = cantools.database.load_file(Path(__file__).parents[1] / "pneuforce.dbc")
FORCE, STATUS, ANSWER, COMMAND = (
    DBC.get_message_by_name(name) for name in ("Force", "Status", "Answer", "Command")
)
MAX_AGE_S = 0.1  # ten periods at 100 Hz: one frame may be lost, but an old force must not be used
LEASE_S, RETRY_S, SILENCE_S = 1.0, 0.1, 3.0
SETPOINT_KPA = (2.0, 12.0)
INFLATED = ("inflating", "settling", "holding")
TARGET_N, GAIN_MM_PER_S_N, BACK_OFF_MM_PER_S = 1.5, 2.0, -5.0
MAX_FALL_N_PER_S, FALL_N = 1.0, 0.1  # after a faster and larger fall of the force, do not move forward


def decode(message, frame):
    """Return the values of a frame, or None if the frame is not this message."""
    if frame.arbitration_id != message.frame_id or frame.is_extended_id or frame.is_remote_frame:
        return None
    return message.decode(frame.data) if len(frame.data) == message.length else None


class Reading(NamedTuple):
    """Value with its validity. `valid` is True if the value may be used."""

    value: float = math.nan
    valid: bool = False


class ForceInput:
    """Latest force for a control loop, with the checks that make it valid."""

    def __init__(self):
        self.lost = 0
        self.falls = False  #: True if the force falls as after a burst of the balloon: do not move forward
        self._last = None
        self._received_s = -math.inf
        self._reference_n = 0.0  # never below the force, and falls by at most MAX_FALL_N_PER_S

    def take(self, frame, now_s):
        """Store a Force frame. A frame with an unchanged counter is ignored: a gateway has repeated it."""
        before, self._last = self._last, frame
        if before is None or frame["counter"] != before["counter"]:
            self.lost += (frame["counter"] - before["counter"] - 1) % 256 if before else 0
            age_s, self._received_s = now_s - self._received_s, now_s
            self._watch_fall(age_s)

    def _watch_fall(self, age_s):
        """Compare the force with the reference. After a burst, the force is valid at first, but falls."""
        force = self.force(self._received_s)
        self._reference_n -= MAX_FALL_N_PER_S * max(0.0, age_s)
        if force.valid:
            self._reference_n = max(force.value, self._reference_n)
        self.falls = force.valid and force.value < self._reference_n - FALL_N

    def force(self, now_s):
        """Return the force [N].

        The receiver checks the age of the force, because a stopped sender cannot report an error.
        """
        last, age_s = self._last, now_s - self._received_s
        if last is None or not 0 <= age_s <= MAX_AGE_S or not last["force_valid"]:
            return Reading()
        force_n = last["force"]  # a float, or the name of the code for "not available"
        return Reading(force_n, True) if isinstance(force_n, float) else Reading()

    @property
    def above_limit(self):
        """Return True if the last frame reports a force above the force limit."""
        return bool(self._last and self._last["force_high_alarm"])

    @property
    def simulated(self):
        """Return True if the last frame comes from a simulation or a replay: a machine must not start."""
        return bool(self._last and self._last["simulated"])


def speed_mm_per_s(force_input, now_s):
    """Return the speed of an admittance control: forward (+) if the force is too small, else back (-).

    The robot also moves back if the force is unknown. It does not move forward if the force falls as after
    a burst. An interpolated force (bit 2 of the condensed status) is valid, but approximate: choose a
    TARGET_N above register 28, 1.23 N at 8 kPa.
    """
    force = force_input.force(now_s)
    if not force.valid or force_input.above_limit:
        return BACK_OFF_MM_PER_S
    speed = GAIN_MM_PER_S_N * (TARGET_N - force.value)
    return min(speed, 0.0) if force_input.falls else speed


class Inflation:
    """Sequence of Commands that inflates the balloon and renews the lease.

    The Commands lease, vent and hold are sent in this order. Each is repeated until its Answer arrives, and
    the vent until the frame Status shows it: the first Status after the Answer may still show the balloon
    that was held before. The lease is the first, so that a rejected lease changes nothing: a vent would also
    vent the balloon of a client on another bus. After the hold, the Command lease renews the lease, until the
    balloon is vented.
    """

    def __init__(self, setpoint_kpa, proof_test="allowed"):
        self.failure = ""  #: why the hold has ended. The program must end, too
        self._setpoint_kpa, self._proof_test = setpoint_kpa, proof_test
        self._leased = self._held = self._inflated = self._other_holder = self._vent_answered = False
        self._modes = ["lease", "vent", "hold", "lease"]  # the first is the present Command
        # A number that differs after a restart of the program: the instrument rejects a hold that it already
        # had before the last vent.
        self._sequence = time.time_ns() // 1_000_000 % 256
        self._next_s = -math.inf

    def due(self, now_s):
        """Return the Command to send now, or None."""
        if now_s < self._next_s:
            return None
        self._next_s = now_s + (LEASE_S / 3 if self._held else RETRY_S)
        return self._command(self._modes[0], LEASE_S, self._proof_test)

    def take(self, answer):
        """Handle an Answer frame."""
        if answer["sequence"] != self._sequence:
            return
        if answer["result"] not in ("accepted", "renewed"):
            # do not retry: a person must first remove the cause
            self.failure = (
                f"The Command was rejected with {answer['result']}. See the results in docs/robot.md"
            )
            self._other_holder = not self._leased or answer["result"] == "rejected_lease"
        elif self._modes[0] == "vent":
            self._vent_answered = True
        elif not self._held:
            self._leased = True
            self._begin_next()

    def _begin_next(self):
        self._held = self._modes.pop(0) == "hold"
        self._next_s, self._sequence = -math.inf, (self._sequence + 1) % 256

    def take_state(self, state):
        """Handle the state in a Status frame.

        The lease of a vented balloon must not be renewed: it prevents that another client clears the faults.
        """
        if self._modes[0] == "vent" and self._vent_answered and state not in INFLATED:
            self._begin_next()
        self._inflated = self._held and (self._inflated or state in INFLATED)
        if self._held and (state == "tripped" or (self._inflated and state not in INFLATED)):
            vented = "another client has vented, or the instrument has ended"
            cause = "pneuforce status names the fault" if state == "tripped" else vented
            self.failure = f"The hold has ended: the state is {state}: {cause}"

    def vent_and_release(self):
        """Return the last Command, which vents and ends the lease. A lease that expires trips the rig.

        Before the Answer to the Command lease, only the lease is ended. Returns None if another bus has the
        lease, because a vent would vent the balloon of the client there.
        """
        if self._other_holder:
            return None
        self._sequence = (self._sequence + 1) % 256
        return self._command("vent" if self._leased else "lease", 0.0, "allowed")

    def _command(self, mode, lease_s, proof_test):
        setpoint_kpa = self._setpoint_kpa if mode == "hold" else 0.0
        values = {"setpoint": setpoint_kpa, "mode": mode, "sequence": self._sequence}
        data = COMMAND.encode(values | {"lease": lease_s, "proof_test": proof_test})
        return can.Message(arbitration_id=COMMAND.frame_id, data=data, is_extended_id=False)


def take(frame, force_input, inflation):
    """Pass a frame to the part of the program that uses it. Return True if the instrument sent the frame."""
    if (force := decode(FORCE, frame)) is not None:
        force_input.take(force, time.monotonic())
    elif (answer := decode(ANSWER, frame)) is not None:
        if inflation:
            inflation.take(answer)
    elif (status := decode(STATUS, frame)) is not None:
        if inflation:
            inflation.take_state(status["state"])
    else:
        return False
    return True


def run(bus, inflation, stopped):
    """Run the control loop. Its last speed is back. Raises OSError if no frame arrives."""
    force_input, printed_mm_per_s, received_s = ForceInput(), None, time.monotonic()
    try:
        while not stopped and not (inflation and inflation.failure):
            frame = bus.recv(0.02)
            while frame is not None:  # after a pause, many frames wait: only the last force is new
                if take(frame, force_input, inflation):
                    received_s = time.monotonic()
                frame = bus.recv(0)
            now_s = time.monotonic()
            speed = speed_mm_per_s(force_input, now_s)
            if speed != printed_mm_per_s:
                printed_mm_per_s = speed
                print_speed(force_input, force_input.force(now_s), speed)
            if now_s - received_s > SILENCE_S:
                raise OSError(f"no frame of the instrument for {SILENCE_S:g} s")
            command = inflation.due(now_s) if inflation else None
            if command is not None:
                bus.send(command)
    finally:
        if printed_mm_per_s != BACK_OFF_MM_PER_S:
            print_speed(force_input, Reading(), BACK_OFF_MM_PER_S)


class OutputFailed(Exception):
    """Error of stdout, for example because the program that reads the output has ended."""


def print_speed(force_input, force, speed):
    notes = f"{force_input.lost} lost{', simulated' if force_input.simulated else ''}"
    try:
        print(f"force {force.value:.3f} N, valid {force.valid}: {speed:+.3f} mm/s, {notes}", flush=True)
    except OSError as error:  # not an error of the bus
        raise OutputFailed from error


def setpoint_kpa(text):
    """Return the setpoint. Raises ValueError outside the range of the Command."""
    if not SETPOINT_KPA[0] <= (value := float(text)) <= SETPOINT_KPA[1]:
        raise ValueError
    return value


def open_bus(options):
    """Return the open bus. Raises OSError or CanError."""
    arguments = {}
    if options.interface == "socketcand":
        socket.create_connection((options.host, options.port), 3.0).close()  # python-can tries for 10 s
        arguments = {"host": options.host, "port": options.port, "tcp_tune": True}
    return can.Bus(interface=options.interface, channel=options.channel, **arguments)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--interface", default="socketcan", help="python-can interface")
    parser.add_argument("--channel", default="can0", help="channel of the interface")
    parser.add_argument("--host", default="127.0.0.1", help="socketcand only: address of the server")
    parser.add_argument("--port", type=int, default=29536, help="socketcand only: TCP port of the server")
    parser.add_argument("--setpoint", type=setpoint_kpa, help="2 to 12 kPa; by default, nothing is sent")
    parser.add_argument("--no-proof-tests", action="store_true", help="forbid proof tests during the hold")
    options = parser.parse_args()
    logging.getLogger("can").setLevel(logging.CRITICAL)  # python-can logs each frame that arrives in pieces
    stopped = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stopped.append(True))
    proof_test = "forbidden" if options.no_proof_tests else "allowed"
    inflation = Inflation(options.setpoint, proof_test) if options.setpoint else None
    try:
        with open_bus(options) as bus:
            try:
                run(bus, inflation, stopped)
            finally:
                command = inflation.vent_and_release() if inflation else None
                if command is not None:
                    bus.send(command)
    except OutputFailed as error:
        os.dup2(
            os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno()
        )  # the text is flushed again at the exit
        cause = error.__cause__
        sys.exit(1 if isinstance(cause, BrokenPipeError) else f"The output failed: {cause.strerror}")
    except (can.CanError, OSError) as error:
        reason = str(error).partition("\n")[0]
        sys.exit(f"The CAN bus failed: {reason}. Check the instrument, and the CAN interface or the CAN hub")
    if inflation and inflation.failure:
        sys.exit(inflation.failure)


if __name__ == "__main__":
    main()
