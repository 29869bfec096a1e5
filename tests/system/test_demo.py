"""Tests of `pneuforce demo`, which a user or a script starts and ends."""

import math
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from pneuforce.registers.modbus.client import ModbusClient
from pneuforce.teststand.stack import free_port
from tests.command_runner import pneuforce
from tests.system.conftest import answers
from tests.system.waiting import wait_for


class Demo:
    """Running demo on free ports."""

    def __init__(self, *arguments):
        self.begun_s = time.monotonic()
        self.modbus_port, self.can_port = free_port(), free_port()
        ports = ["--modbus-port", str(self.modbus_port), "--can-port", str(self.can_port), "--web-port", "0"]
        self.process = subprocess.Popen(
            # The tests may have been started with nohup, which ignores the signal.
            ["env", "--default-signal=HUP", sys.executable, "-m", "pneuforce", "demo", *ports, *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def children(self):
        threads = Path(f"/proc/{self.process.pid}/task").glob("*/children")
        listed = " ".join(thread.read_text() for thread in threads)
        return [int(pid) for pid in listed.split()]

    def until_holding(self):
        self.until("holding")

    def until(self, state):
        wait_for(lambda: answers(self.modbus_port), bool)
        with ModbusClient.connect(port=self.modbus_port) as plc:
            wait_for(plc.read, lambda v: v["state"] == state)


@pytest.fixture
def folder(monkeypatch):
    """Return the folder in which the demo makes its own. Its path is short, because it contains a socket."""
    with TemporaryDirectory(prefix="demo-") as short:
        monkeypatch.setenv("TMPDIR", short)
        yield Path(short)


@pytest.fixture
def demo(folder):
    started = Demo()
    yield started
    started.process.kill()
    started.process.communicate()


def running(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_the_demo_and_its_children_sooner_than_they_started(demo, number, folder):
    demo.until_holding()
    started_s = time.monotonic() - demo.begun_s
    children = demo.children()
    assert len(children) == 3
    signalled_s = time.monotonic()
    demo.process.send_signal(number)
    _, stderr = demo.process.communicate(timeout=60)
    assert time.monotonic() - signalled_s < started_s
    assert demo.process.returncode == 0
    assert "Traceback" not in stderr
    assert not any(running(pid) for pid in children)
    assert list(folder.glob("pneuforce-*")) == []


def test_the_demo_inflates_again_after_the_computer_was_suspended_and_reports_why_the_rig_tripped(demo):
    """The suspension begins during the inflation, before the demo has observed its own hold."""
    demo.until("inflating")
    processes = [demo.process.pid, *demo.children()]
    for pid in processes:
        os.kill(pid, signal.SIGSTOP)
    time.sleep(3.0)
    for pid in processes:
        os.kill(pid, signal.SIGCONT)
    with ModbusClient.connect(port=demo.modbus_port) as plc:
        wait_for(plc.read, lambda v: v["state"] == "tripped")
        wait_for(plc.read, lambda v: v["state"] == "holding")
    demo.process.terminate()
    stdout, _ = demo.process.communicate(timeout=60)
    assert re.search(r"\(fault \d+\)", stdout), stdout
    assert re.search(r"^local socket .*/pneuforce\.sock$", stdout, re.MULTILINE), stdout


def test_the_demo_does_not_clear_a_fault_of_the_rig(demo):
    demo.until_holding()
    with ModbusClient.connect(port=demo.modbus_port) as plc:
        plc.write("lease", 0.2)
        wait_for(plc.read, lambda v: v["state"] == "tripped")
        time.sleep(2.5)
        assert plc.read()["state"] == "tripped"


def test_a_killed_demo_leaves_no_child_behind(demo):
    demo.until_holding()
    children = demo.children()
    demo.process.kill()
    wait_for(lambda: [pid for pid in children if running(pid)], lambda left: not left)


def test_without_a_terminal_the_demo_prints_one_plain_line_per_second_and_ends_in_time():
    demo = Demo("--seconds", "10")
    stdout, stderr = demo.process.communicate(timeout=60)
    assert demo.process.returncode == 0
    assert stderr == ""
    url, control, *lines = stdout.splitlines()
    assert re.fullmatch(r"http://127\.0\.0\.1:\d+/#user=demo&password=[\w-]{16}", url)
    assert 0 < int(control.rpartition(" ")[2]) < 65536
    assert 8 <= len(lines) <= 11
    assert all("\x1b" not in line for line in lines)
    force = re.compile(
        r"holding\s+force ± u\s+\d\.\d{3} ± \d\.\d{3} N\s+CAN \d\.\d{3} N  applied .* contacts 1"
    )
    assert any(force.search(line) for line in lines), stdout


def test_a_port_in_use_is_reported_with_its_option_and_its_user_is_not_disturbed(stack):
    free = {"modbus": free_port(), "can": free_port(), "control": 0, "web": 0}
    taken = dict.fromkeys(("modbus", "web"), stack.modbus_port)
    taken |= dict.fromkeys(("can", "control"), stack.can_port)
    for name, port in taken.items():
        options = [word for key, at in {**free, name: port}.items() for word in (f"--{key}-port", at)]
        refused = pneuforce("demo", *options)
        assert refused.returncode == 69
        assert refused.stderr == (
            f"pneuforce: --{name}-port {port} is in use by another program: choose another port\n"
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


def test_the_demo_commands_the_setpoints_of_its_scenario(tmp_path):
    (tmp_path / "two.toml").write_text(TWO_SETPOINTS)
    demo = Demo("--scenario", str(tmp_path / "two.toml"), "--seconds", "40")
    holding = re.compile(r"holding .* setpoint (\d\.\d{3}) kPa .* contacts ([12])")
    seen = []
    for line in demo.process.stdout:
        seen += [found.groups() for found in [holding.search(line)] if found]
        if ("8.000", "1") in seen:
            break
    demo.process.terminate()
    demo.process.communicate(timeout=60)
    assert ("6.000", "1") in seen
    assert ("8.000", "1") in seen


def test_an_unknown_scenario_is_reported_before_anything_starts():
    refused = subprocess.run(
        [sys.executable, "-m", "pneuforce", "demo", "--scenario", "palpate"],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert refused.returncode == 2
    assert "'palpate'" in refused.stderr
    assert "campaign" in refused.stderr
    assert len(refused.stderr.splitlines()) == 1
