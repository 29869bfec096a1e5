"""`pneuforce demo` as a person or a script starts and ends it."""

import math
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from registers.modbus.client import Plc
from tests.system.conftest import answers
from tests.system.waiting import wait_for
from tests.typed import pneuforce
from teststand.stack import free_port


class Demo:
    def __init__(self, *arguments):
        self.modbus_port, self.can_port = free_port(), free_port()
        ports = ["--modbus-port", str(self.modbus_port), "--can-port", str(self.can_port), "--page-port", "0"]
        self.process = subprocess.Popen(
            [sys.executable, "-m", "instrument", "demo", *ports, *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def children(self):
        listed = Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text()
        return [int(pid) for pid in listed.split()]

    def until_holding(self):
        wait_for(lambda: answers(self.modbus_port), bool)
        with Plc.connect(port=self.modbus_port) as plc:
            wait_for(plc.read, lambda v: v["state"] == "holding")


@pytest.fixture(scope="module")
def demos():
    """All that are to be ended, started at once: what a demo takes most of is waiting."""
    started = [Demo() for _ in range(3)]
    yield started
    for each in started:
        each.process.kill()
        each.process.communicate()


@pytest.fixture
def demo(demos):
    """One that nobody has ended yet."""
    return next(each for each in demos if each.process.poll() is None)


def running(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_demo_and_its_children_within_a_second(demo, number):
    demo.until_holding()
    children = demo.children()
    assert len(children) == 3
    asked_s = time.monotonic()
    demo.process.send_signal(number)
    _, said = demo.process.communicate(timeout=5)
    assert time.monotonic() - asked_s < 3.0  # one second, on a machine that does nothing else
    assert demo.process.returncode == 0
    assert "Traceback" not in said
    assert not any(running(pid) for pid in children)


def test_a_killed_demo_leaves_no_child_behind(demo):
    demo.until_holding()
    children = demo.children()
    demo.process.kill()
    wait_for(lambda: [pid for pid in children if running(pid)], lambda left: not left, deadline_s=3)


def test_without_a_terminal_it_says_one_plain_line_a_second_and_ends_in_time():
    begun_s = time.monotonic()
    demo = Demo("--seconds", "10")
    said, complaints = demo.process.communicate(timeout=30)
    assert demo.process.returncode == 0
    assert complaints == ""
    assert time.monotonic() - begun_s < 18
    url, *lines = said.splitlines()
    assert re.fullmatch(r"http://127\.0\.0\.1:\d+/#operator=[\w-]{16}", url)
    assert 8 <= len(lines) <= 11
    assert all("\x1b" not in line for line in lines)
    force = re.compile(r"holding\s+force\s+\d\.\d{3} ± \d\.\d{3} N\s+CAN \d\.\d{3} N  applied .* contacts 1")
    assert any(force.search(line) for line in lines), said


def test_a_taken_port_is_said_by_its_option_and_its_owner_is_left_alone(stack):
    free = {"modbus": free_port(), "can": free_port(), "control": 0, "page": 0}
    taken = dict.fromkeys(("modbus", "page"), stack.modbus_port)
    taken |= dict.fromkeys(("can", "control"), stack.can_port)
    for name, port in taken.items():
        options = [word for key, at in {**free, name: port}.items() for word in (f"--{key}-port", at)]
        refused = pneuforce("demo", *options)
        assert refused.returncode == 2
        assert refused.stderr == (
            f"pneuforce: --{name}-port {port} is in use by another program: choose another\n"
        )
    with stack.plc() as plc:
        assert math.isnan(plc.read()["setpoint_requested"])


TWO_SETPOINTS = """
doc = "A tap at each of two setpoints."
[[phase]]
setpoint_kpa = [6.0, 8.0]
[[phase.contact]]
kind = "tap"
force_n = 1.0
pause_s = 0.3
"""


def test_the_demo_commands_the_setpoints_of_its_scenario_as_its_contacts_come(tmp_path):
    (tmp_path / "two.toml").write_text(TWO_SETPOINTS)
    demo = Demo("--scenario", str(tmp_path / "two.toml"), "--seconds", "40")
    holding = re.compile(r"holding .* setpoint (\d\.\d{3}) kPa .* contacts ([12])")
    seen = []
    for line in demo.process.stdout:
        seen += [found.groups() for found in [holding.search(line)] if found]
        if ("8.000", "1") in seen:
            break
    demo.process.terminate()
    demo.process.communicate(timeout=5)
    assert ("6.000", "1") in seen
    assert ("8.000", "1") in seen


def test_a_scenario_that_is_not_there_is_said_in_a_sentence_before_anything_starts():
    refused = subprocess.run(
        [sys.executable, "-m", "instrument", "demo", "--scenario", "palpate"],
        capture_output=True,
        text=True,
        timeout=30,
        check=False,
    )
    assert refused.returncode == 2
    assert refused.stderr.startswith("pneuforce: there is no scenario 'palpate', only campaign, ")
