"""Tests that run the shell commands of the robot guide with a running instrument."""

import contextlib
import os
import re
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from pneuforce.client import measurement
from pneuforce.registers.views import dbc
from pneuforce.teststand.stack import free_port
from tests.system.waiting import wait_for
from tests.tools import needs

TOP = Path(__file__).parents[2]
GUIDE = (TOP / "docs/robot.md").read_text(encoding="utf-8")
FIVE_MINUTES, IN_CPP, WITH_COMMANDS, ON_HARDWARE, PLAYBACK = re.findall(r"```sh\n(.*?)```", GUIDE, re.DOTALL)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return a folder with those parts of the project folder that the guide uses."""
    made = tmp_path_factory.mktemp("clone")
    (made / "docs").symlink_to(TOP / "docs")
    return made


@pytest.fixture
def run_commands(folder, shared_stack):
    """Return a function that runs a block of the guide, with shorter times and other ports."""
    hub = str(free_port())
    with shared_stack.robot() as robot:
        assert robot.recv(5.0)  # the instrument listens for 1.2 s before it sends

    def run(block):
        block = re.sub(r"(watch can|canlog|cansend)(?! --port)", rf"\1 --port {shared_stack.can_port}", block)
        block = re.sub(r"(canlog.*)--seconds 5", r"\1--seconds 2", block)
        block = block.replace("--seconds 5", "--seconds 3")
        block = block.replace("29536", str(shared_stack.can_port)).replace("29540", hub)
        block = block.replace(".venv/bin/python docs", f"timeout -s INT 4 {sys.executable} -u docs")
        block = block.replace(".venv/bin/python -m", f"PYTHONPATH={TOP} {sys.executable} -m")
        block = block.replace(".venv/bin/pneuforce", f"PYTHONPATH={TOP} {sys.executable} -m pneuforce")
        # a reader types the next line about two seconds later
        block = re.sub(r"^([^(]*) &\n", r"\1 &\nsleep 2\n", block, flags=re.MULTILINE)
        return run_shell(block + "\nwait", folder)

    return run


def run_shell(commands, folder):
    """Run shell commands, and end all of their processes if they need more than a minute."""
    with subprocess.Popen(
        ["bash", "-c", commands],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as shell:
        try:
            stdout, stderr = shell.communicate(timeout=60)
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(shell.pid, signal.SIGKILL)
    return subprocess.CompletedProcess(commands, shell.returncode, stdout, stderr)


def test_the_program_of_the_guide_knows_each_reason_for_a_missing_force():
    [names] = re.findall('^REASONS = "(.*)"', GUIDE, re.MULTILINE)
    assert names.split() == [reason.value for reason in measurement._REASONS]


def test_the_commands_of_the_first_five_minutes(run_commands, folder):
    lines = [line.partition("  #")[0] for line in FIVE_MINUTES.splitlines() if "pip install" not in line]
    [write_dbc] = [line for line in lines if " map " in line]
    run_commands(write_dbc + "\n")
    done = run_commands("".join(f"( {line} ) &\n" for line in lines if line != write_dbc))
    assert "Traceback" not in done.stderr, done.stderr
    assert re.search(r"Force +force not available +pressure ", done.stdout)
    assert re.search(r"Heartbeat +node_state operational", done.stdout)
    assert "force nan N, valid False: -5.000 mm/s, 0 lost" in done.stdout
    assert (folder / "press.log").read_text().count(" 185#") > 30
    assert (folder / "pneuforce.dbc").read_text(encoding="utf-8") == dbc.render(5)


def test_the_program_that_prints_the_force_explains_a_missing_force(shared_stack, folder):
    [program] = [text for text in re.findall(r"```python\n(.*?)```", GUIDE, re.DOTALL) if "29536" in text]
    program = program.replace("29536", str(shared_stack.can_port))
    with subprocess.Popen(
        [sys.executable, "-u", "-c", program], cwd=folder, stdout=subprocess.PIPE, text=True
    ) as running:
        lines = iter(running.stdout.readline, "")
        explained = next(line for line in lines if "state" in line)
        running.kill()
    assert re.match("no force: state vented, function_check; .*pneuforce status", explained)


@needs("g++")
def test_the_cpp_listener_builds_and_runs(run_commands):
    done = run_commands(IN_CPP)
    assert "error" not in done.stderr, done.stderr
    assert done.stdout.count("Loop ") == done.stdout.count("speed=-5.000") == 1
    assert len(re.findall("^Force force=-?nan .*valid=0$", done.stdout, re.MULTILINE)) > 30


@needs("g++")
def test_the_cpp_listener_inflates_the_balloon_over_the_hub(run_commands, folder, shared_stack):
    if not (folder / "robot_listener").exists():
        run_commands(IN_CPP.splitlines()[0])
    block = WITH_COMMANDS.replace("--seconds 20", "--seconds 10")
    with shared_stack.plc() as plc:
        running = threading.Thread(target=run_commands, args=(block,))
        running.start()
        wait_for(plc.read, lambda registers: registers["state"] == "holding")
        running.join()
        wait_for(plc.read, lambda registers: registers["state"] == "vented")
        assert plc.read()["lease_holder"] == "none"


def test_a_recording_can_be_played_back(run_commands, folder):
    if not (folder / "press.log").exists():
        run_commands(next(line for line in FIVE_MINUTES.splitlines() if "canlog" in line) + "\n")
    done = run_commands(PLAYBACK)
    assert "Traceback" not in done.stderr, done.stderr
    assert len(re.findall(r"Force +force not available", done.stdout)) > 30


def test_on_hardware_only_standard_tools_are_used():
    assert {line.split()[0] for line in ON_HARDWARE.splitlines()} == {"sudo", "candump", "cansend"}
