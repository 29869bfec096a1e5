"""The robot guide's listeners hold a balloon on a running instrument, follow its force, and vent it."""

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
WANTED_N, GAIN_MM_PER_S_N, BACK_OFF = 1.5, 2.0, -5.0


class Listener:
    """A listener at work: what it says, and the speed that it said last."""

    def __init__(self, process):
        self.process = process
        self.speed_mm_per_s = None
        self.lines = []

    def hear(self, line):
        self.lines.append(line)
        speed = re.search(r"speed=(\S+)|: (\S+) mm/s", line)
        if speed:
            self.speed_mm_per_s = float(speed[1] or speed[2])

    def force_n(self):
        """What it takes the force for; None while it backs off."""
        return None if self.speed_mm_per_s == BACK_OFF else WANTED_N - self.speed_mm_per_s / GAIN_MM_PER_S_N

    def until(self, wanted):
        return wait_for(lambda: self.speed_mm_per_s, wanted)


@contextmanager
def reading(process, hear):
    def read():
        for line in process.stdout:
            hear(line)

    thread = Thread(target=read, daemon=True)
    thread.start()
    try:
        yield
    finally:
        process.kill()
        thread.join(5)


@contextmanager
def in_python(stack, tmp_path):
    bus = ["--interface", "socketcand", "--host", "127.0.0.1", "--port", str(stack.can_port)]
    command = [sys.executable, "-u", EXAMPLES / "robot_listener.py", *bus, "--setpoint", "6.0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        listener = Listener(process)
        with reading(process, listener.hear):
            yield listener


@contextmanager
def in_cpp(stack, tmp_path):
    """Its frames come from a recording under way; the Commands that it prints are put on the bus."""
    canlog = [sys.executable, "-m", "instrument", "canlog", "--port", str(stack.can_port)]
    with (
        stack.robot() as bus,
        subprocess.Popen(canlog, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as frames,
        subprocess.Popen(
            [compiled(tmp_path), "-", "6.0"], stdin=frames.stdout, stdout=subprocess.PIPE, text=True
        ) as process,
    ):
        listener = Listener(process)

        def hear(line):
            command = re.search("can0 205#(.*)", line)
            if command:
                data = bytes.fromhex(command[1])
                bus.send(can.Message(arbitration_id=0x205, data=data, is_extended_id=False))
            listener.hear(line)

        try:
            with reading(process, hear):
                yield listener
        finally:
            frames.kill()


@pytest.mark.parametrize("listening", [in_python, pytest.param(in_cpp, marks=needs("g++"))])
def test_it_inflates_follows_the_force_and_leaves_a_vented_balloon(stack, tmp_path, listening):
    with stack.plc() as plc:
        wait_for(plc.read, lambda v: "not_zeroed" not in v["status"])
        with listening(stack, tmp_path) as listener:
            listener.until(lambda speed: speed == WANTED_N * GAIN_MM_PER_S_N)  # held, and nothing touches
            assert plc.read()["lease_holder"] == "can"
            stack.order(press=2.0)
            listener.until(lambda _: (listener.force_n() or 0.0) > 1.9)
            assert listener.force_n() == pytest.approx(2.0, abs=0.15)
            listener.process.send_signal(signal.SIGINT)
            left = wait_for(plc.read, lambda v: v["state"] == "vented" and v["lease_holder"] == "none")
            assert listener.process.wait(5) == 0
            assert "lease_expired" not in left["status"]
