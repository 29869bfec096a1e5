"""Tests of the example programs of docs/robot.md: each inflates the balloon, follows the force and vents."""

import re
import signal
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path
from threading import Thread

import can
import pytest

from tests.registers.views.cpp_listener import compiled
from tests.system.waiting import wait_for
from tests.tools import needs

EXAMPLES = Path(__file__).parents[2] / "docs/examples"
TARGET_N, GAIN_MM_PER_S_N, BACK_OFF = 1.5, 2.0, -5.0


class Listener:
    """Output of a running listener, and the last speed in it."""

    def __init__(self, process):
        self.process = process
        self.speed_mm_per_s = None
        self.lines = []

    def handle_line(self, line):
        self.lines.append(line)
        speed = re.search(r"speed=(\S+)|: (\S+) mm/s", line)
        if speed:
            self.speed_mm_per_s = float(speed[1] or speed[2])

    def force_n(self):
        """Return the force [N] on which the listener acts; None while it backs off."""
        return None if self.speed_mm_per_s == BACK_OFF else TARGET_N - self.speed_mm_per_s / GAIN_MM_PER_S_N

    def wait_for_speed(self, condition):
        return wait_for(lambda: self.speed_mm_per_s, condition)


@contextmanager
def read_output(process, handle_line):
    def read():
        for line in process.stdout:
            handle_line(line)

    thread = Thread(target=read, daemon=True)
    thread.start()
    try:
        yield
    finally:
        process.kill()
        thread.join(5)


@contextmanager
def python_listener(stack, tmp_path):
    bus = ["--interface", "socketcand", "--host", "127.0.0.1", "--port", str(stack.can_port)]
    command = [sys.executable, "-u", EXAMPLES / "robot_listener.py", *bus, "--setpoint", "6.0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        listener = Listener(process)
        with read_output(process, listener.handle_line):
            yield listener


@contextmanager
def cpp_listener(stack, tmp_path):
    """Connect the listener to the bus: `pneuforce canlog` is its input; its Commands are sent to the bus."""
    canlog = [sys.executable, "-m", "pneuforce", "canlog", "--port", str(stack.can_port)]
    with (
        stack.robot() as bus,
        subprocess.Popen(canlog, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as frames,
        subprocess.Popen(
            [compiled(tmp_path), "-", "6.0"], stdin=frames.stdout, stdout=subprocess.PIPE, text=True
        ) as process,
    ):
        listener = Listener(process)

        def handle_line(line):
            command = re.search("can0 205#(.*)", line)
            if command:
                data = bytes.fromhex(command[1])
                bus.send(can.Message(arbitration_id=0x205, data=data, is_extended_id=False))
            listener.handle_line(line)

        try:
            with read_output(process, handle_line):
                yield listener
        finally:
            frames.kill()


@pytest.mark.parametrize("start_listener", [python_listener, pytest.param(cpp_listener, marks=needs("g++"))])
def test_a_listener_inflates_follows_the_force_and_vents_at_its_end(stack, tmp_path, start_listener):
    with stack.plc() as plc:
        wait_for(plc.read, lambda v: "not_zeroed" not in v["status"])
        with start_listener(stack, tmp_path) as listener:
            listener.wait_for_speed(lambda speed: speed == TARGET_N * GAIN_MM_PER_S_N)  # holding, no contact
            assert plc.read()["lease_holder"] == "can"
            stack.request(press=2.0)
            listener.wait_for_speed(lambda _: (listener.force_n() or 0.0) > 1.9)
            assert listener.force_n() == pytest.approx(2.0, abs=0.15)
            listener.process.send_signal(signal.SIGINT)
            final = wait_for(plc.read, lambda v: v["state"] == "vented" and v["lease_holder"] == "none")
            assert listener.process.wait(60) == 0
            assert "lease_expired" not in final["status"]
