"""What the robot guide tells to type, typed beside a running instrument."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from registers.views import dbc
from tests.tools import needs
from tests.typed import pneuforce
from teststand.stack import free_port

TOP = Path(__file__).parents[2]
GUIDE = (TOP / "docs/robot.md").read_text(encoding="utf-8")
FIVE_MINUTES, IN_CPP, ON_HARDWARE, AGAIN = re.findall(r"```sh\n(.*?)```", GUIDE, re.DOTALL)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A clone's top as far as the guide needs it."""
    made = tmp_path_factory.mktemp("clone")
    (made / "docs").symlink_to(TOP / "docs")
    return made


@pytest.fixture
def type_(folder, lasting_stack):
    """Types a block of the guide: in a second or two instead of five, beside this instrument."""
    hub = str(free_port())
    with lasting_stack.robot() as robot:
        assert robot.recv(5.0)  # it listens for 1.2 s before it sends

    def run(block):
        block = re.sub(r"(watch can|canlog)(?! --port)", rf"\1 --port {lasting_stack.can_port}", block)
        block = re.sub(r"(canlog.*)--seconds 5", r"\1--seconds 1", block)
        block = block.replace("--seconds 5", "--seconds 1.5").replace("--seconds 8", "--seconds 4")
        block = block.replace("29536", str(lasting_stack.can_port)).replace("29540", hub)
        block = block.replace(".venv/bin/python docs", f"timeout -s INT 1.5 {sys.executable} -u docs")
        block = block.replace(".venv/bin/python -m", f"PYTHONPATH={TOP} {sys.executable} -m")
        block = block.replace(".venv/bin/pneuforce", f"PYTHONPATH={TOP} {sys.executable} -m instrument")
        block = re.sub(r"^([^(]*) &\n", r"\1 &\nsleep 1\n", block, flags=re.M)  # as long as a person takes
        shell = ["bash", "-c", block + "\nwait"]
        return subprocess.run(shell, cwd=folder, capture_output=True, text=True, timeout=30, check=False)

    return run


def test_five_minutes(type_, folder):
    lines = [line.partition("  #")[0] for line in FIVE_MINUTES.splitlines() if "pip install" not in line]
    done = type_("".join(f"( {line} ) &\n" for line in lines))
    assert "Traceback" not in done.stderr, done.stderr
    assert re.search(r"Force +force not available +pressure ", done.stdout)
    assert re.search(r"Heartbeat +node_state operational", done.stdout)
    assert "force nan N, valid False: -5.000 mm/s, 0 lost" in done.stdout
    assert (folder / "press.log").read_text().count(" 185#") > 30


@needs("g++")
def test_in_cpp(type_):
    done = type_(IN_CPP)
    assert "error" not in done.stderr, done.stderr
    assert done.stdout.count("Loop ") == done.stdout.count("speed=-5.000") == 1
    assert len(re.findall("^Force force=-?nan .*valid=0$", done.stdout, re.MULTILINE)) > 30


def test_a_recording_again(type_, folder):
    if not (folder / "press.log").exists():
        type_(FIVE_MINUTES.splitlines()[1] + "\n")
    done = type_(AGAIN)
    assert "Traceback" not in done.stderr, done.stderr
    assert len(re.findall(r"Force +force not available", done.stdout)) > 30


def test_on_hardware_nothing_else_is_used():
    assert {line.split()[0] for line in ON_HARDWARE.splitlines()} == {"sudo", "candump", "cansend"}


def test_the_dbc_of_another_node_id():
    assert pneuforce("map", "--format", "dbc", "--node-id", "9").stdout == dbc.render(9)
