"""Comparison of the cases with python-canopen's LocalNode, which uses this project's EDS file.

Run `python -m tests.registers.canopen.compare_python_canopen`. It prints each case with a different result
and takes 1.5 minutes.
"""

import io
import logging
import time
from contextlib import contextmanager

import can
import canopen

from pneuforce.registers.can.wire import CanFrame
from pneuforce.registers.views import eds
from tests.registers.canopen.cases import DYNAMIC_CASES, STATIC_CASES
from tests.registers.canopen.fake_master import NMT_COMMAND, format_frames, frames_match, parse_frame

RESPONSE_TIMEOUT_S = 0.08
DEFAULTS = {0x1008: "pneumatic force sensor", 0x1009: "PF-1", 0x100A: "0.1.0", 0x2200: 8.0, 0x2F00: -123.45}


def dictionary():
    """Return the object dictionary of the EDS file, with default values that LocalNode can return."""
    eds_file = io.StringIO(eds.render())
    eds_file.name = "pneuforce.eds"
    od = canopen.import_od(eds_file, 5)
    for index, value in DEFAULTS.items():
        od[index].default = value
    return od


@contextmanager
def local_node(channel):
    """Start a LocalNode with heartbeat on a virtual bus; yield the bus of the master."""
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


def received_frames(bus, seconds):
    until_s, frames = time.monotonic() + seconds, []
    while (left_s := until_s - time.monotonic()) > 0:
        message = bus.recv(left_s)
        frames += [CanFrame(message.arbitration_id, bytes(message.data))] if message else []
    return frames


def response_to(bus, step, expected):
    """Return the frames that a step causes, without heartbeats that the step does not expect."""
    first, _, identifier = step.partition(" ")
    if first.startswith("+"):
        return [frame for frame in received_frames(bus, float(first)) if frame.id == int(identifier, 16)]
    send(bus, parse_frame(step))
    return [
        frame for frame in received_frames(bus, RESPONSE_TIMEOUT_S) if frame.id != 0x705 or "705" in expected
    ]


def difference(channel, state, steps):
    """Return the first difference between LocalNode and the case, or "" if all responses agree."""
    with local_node(channel) as bus:
        if state in NMT_COMMAND:
            send(bus, CanFrame(0, NMT_COMMAND[state]))
        received_frames(bus, 0.02)
        for step, expected in steps:
            frames = response_to(bus, step, expected)
            if not frames_match(expected, frames):
                return f"{step}: {format_frames(frames) or 'no frame'}, expected {expected or 'no frame'}"
    return ""


def main():
    logging.disable(logging.CRITICAL)
    cases = [
        case
        for case in STATIC_CASES + DYNAMIC_CASES
        if not any(step.startswith("faults") for step, _ in case[2])
    ]
    different = 0
    for number, (name, state, steps) in enumerate(cases):
        wrong = difference(f"case {number}", state, steps)
        different += bool(wrong)
        print(f"{name}: {wrong}\n" if wrong else "", end="", flush=True)
    print(f"{len(cases)} cases, {different} with a different result")


if __name__ == "__main__":
    main()
