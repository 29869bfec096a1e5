"""A robot's force loop on pneuforce's CAN frames, by the DBC: python-can and cantools.

    python robot_listener.py                                  # listens on can0
    python robot_listener.py --setpoint 8.0                   # inflates, keeps its lease; Ctrl-C vents
    python robot_listener.py --interface socketcand --host 127.0.0.1 --port 29536      # beside `make run`

pneuforce_can.hpp is the same in C++; the guide is docs/robot.md.
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
FRESH_S = 0.1  # ten periods at 100 Hz: a frame may be lost, an old force not be used
LEASE_S, RETRY_S = 1.0, 0.1
WANTED_N, GAIN_MM_PER_S_N, BACK_OFF_MM_PER_S = 1.5, 2.0, -5.0


class Reading(NamedTuple):
    """A value is never to be had without the word whether it may be used."""

    value: float = math.nan
    valid: bool = False


class ForceInput:
    """What a force loop may believe, and when."""

    def __init__(self):
        self.lost = 0
        self._last = None
        self._seen_s = -math.inf

    def take(self, frame, now_s):
        """A counter that stands still is an old frame, from a gateway that repeats its last one."""
        before, self._last = self._last, frame
        if before is None or frame["counter"] != before["counter"]:
            self.lost += (frame["counter"] - before["counter"] - 1) % 256 if before else 0
            self._seen_s = now_s

    def force(self, now_s):
        """Silence is judged by the receiver's own clock: a sender that is gone sets no bit."""
        last = self._last
        if last is None or now_s - self._seen_s > FRESH_S or not last["force_valid"]:
            return Reading()
        force_n = last["force"]  # a float, or the name of the code for "not available"
        return Reading(force_n, True) if isinstance(force_n, float) else Reading()

    @property
    def above_limit(self):
        return bool(self._last and self._last["force_limit"])


def speed_mm_per_s(force_input, now_s):
    """An admittance: on (+) while the force is too small, back (-) while it is too great, or not known."""
    force = force_input.force(now_s)
    if not force.valid or force_input.above_limit:
        return BACK_OFF_MM_PER_S
    return GAIN_MM_PER_S_N * (WANTED_N - force.value)


class Inflation:
    """Vent, then hold, each until it is answered; then the same Command again renews the lease."""

    def __init__(self, setpoint_kpa):
        self.refused = None
        self._setpoint_kpa = setpoint_kpa
        self._mode, self._sequence, self._wait_s = "vent", 1, RETRY_S
        self._next_s = -math.inf

    def due(self, now_s):
        if now_s < self._next_s:
            return None
        self._next_s = now_s + self._wait_s
        return self._command(self._mode, self._setpoint_kpa, LEASE_S)

    def take(self, answer):
        if answer["sequence"] != self._sequence:
            return
        if answer["result"] not in ("accepted", "renewed"):
            self.refused = str(answer["result"])  # never ask again blindly: somebody has to look
        elif self._mode == "vent":
            self._mode, self._next_s = "hold", -math.inf
            self._sequence += 1
        else:
            self._wait_s = LEASE_S / 3

    def leave(self):
        """The lease goes too: one that is left to run out trips the rig."""
        self._sequence += 1
        return self._command("vent", 0.0, 0.0)

    def _command(self, mode, setpoint_kpa, lease_s):
        values = {"mode": mode, "setpoint": setpoint_kpa, "lease": lease_s, "sequence": self._sequence}
        return can.Message(
            arbitration_id=COMMAND.frame_id,
            data=COMMAND.encode(values | {"reserved": 0}),
            is_extended_id=False,
        )


def run(bus, inflation, stopped):
    force_input, told_mm_per_s = ForceInput(), None
    while not stopped and not (inflation and inflation.refused):
        frame = bus.recv(0.02)
        now_s = time.monotonic()
        if frame is not None and frame.arbitration_id == FORCE.frame_id:
            force_input.take(FORCE.decode(frame.data), now_s)
        elif frame is not None and frame.arbitration_id == ANSWER.frame_id and inflation:
            inflation.take(ANSWER.decode(frame.data))
        speed = speed_mm_per_s(force_input, now_s)
        if speed != told_mm_per_s:
            force = force_input.force(now_s)
            told_mm_per_s = speed
            print(
                f"force {force.value:.3f} N, valid {force.valid}: {speed:+.3f} mm/s, {force_input.lost} lost"
            )
        command = inflation.due(now_s) if inflation else None
        if command is not None:
            bus.send(command)


def main():
    words = argparse.ArgumentParser()
    words.add_argument("--interface", default="socketcan")
    words.add_argument("--channel", default="can0")
    words.add_argument("--host")
    words.add_argument("--port", type=int)
    words.add_argument("--setpoint", type=float, help="kPa; without it nothing is sent")
    given = words.parse_args()
    hub = {"host": given.host, "port": given.port, "tcp_tune": True} if given.host else {}
    stopped = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stopped.append(True))
    inflation = Inflation(given.setpoint) if given.setpoint else None
    with can.Bus(interface=given.interface, channel=given.channel, **hub) as bus:
        try:
            run(bus, inflation, stopped)
        finally:
            if inflation:
                bus.send(inflation.leave())
    if inflation and inflation.refused:
        sys.exit(f"refused, {inflation.refused}: docs/robot.md says what to do")


if __name__ == "__main__":
    main()
