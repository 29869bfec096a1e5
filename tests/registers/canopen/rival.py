"""The cases played to python-canopen's LocalNode, with our data sheet.

`python -m tests.registers.canopen.rival` prints each case that comes out otherwise, in a minute and a half.
"""

import io
import logging
import time
from contextlib import contextmanager

import can
import canopen

from registers.can.wire import CanFrame
from registers.views import eds
from tests.registers.canopen.cases import MOVING, STANDING
from tests.registers.canopen.talking import INTO, agrees, frame_of, told

ANSWER_S = 0.08
GIVEN = {0x1008: "pneumatic force sensor", 0x1009: "PF-1", 0x100A: "0.1.0", 0x2200: 8.0, 0x2F00: -123.45}


def dictionary():
    """Ours, with the values that a dictionary alone can have."""
    sheet = io.StringIO(eds.render())
    sheet.name = "pneuforce.eds"
    od = canopen.import_od(sheet, 5)
    for index, value in GIVEN.items():
        od[index].default = value
    return od


@contextmanager
def served(channel):
    """A LocalNode with heartbeat on a virtual bus, and the bus as a master opens it."""
    network = canopen.Network()
    network.NOTIFIER_SHUTDOWN_TIMEOUT = 0.1
    network.connect(interface="virtual", channel=channel)
    node = network.add_node(canopen.LocalNode(5, dictionary()))
    node.nmt.state = "PRE-OPERATIONAL"
    node.nmt.start_heartbeat(1000)
    with can.Bus(interface="virtual", channel=channel) as bus:
        yield bus
    node.nmt.stop_heartbeat()
    network.disconnect()


def send(bus, frame):
    bus.send(can.Message(arbitration_id=frame.id, data=frame.data, is_extended_id=False))


def heard(bus, seconds):
    until_s, frames = time.monotonic() + seconds, []
    while (left_s := until_s - time.monotonic()) > 0:
        message = bus.recv(left_s)
        frames += [CanFrame(message.arbitration_id, bytes(message.data))] if message else []
    return frames


def said_to(bus, step, expected):
    """What comes of one step, but for heartbeats that nobody asked for."""
    first, _, looked_at = step.partition(" ")
    if first.startswith("+"):
        return [frame for frame in heard(bus, float(first)) if frame.id == int(looked_at, 16)]
    send(bus, frame_of(step))
    return [frame for frame in heard(bus, ANSWER_S) if frame.id != 0x705 or "705" in expected]


def difference(channel, state, steps):
    with served(channel) as bus:
        if state in INTO:
            send(bus, CanFrame(0, INTO[state]))
        heard(bus, 0.02)
        for step, expected in steps:
            frames = said_to(bus, step, expected)
            if not agrees(expected, frames):
                return f"{step}: {told(frames) or 'silence'}, not {expected or 'silence'}"
    return ""


def main():
    logging.disable(logging.CRITICAL)
    cases = [case for case in STANDING + MOVING if not any(step.startswith("faults") for step, _ in case[2])]
    differ = 0
    for number, (name, state, steps) in enumerate(cases):
        wrong = difference(f"rival {number}", state, steps)
        differ += bool(wrong)
        print(f"{name}: {wrong}\n" if wrong else "", end="", flush=True)
    print(f"{len(cases)} cases, {differ} come out otherwise")


if __name__ == "__main__":
    main()
