"""Every command that the README tells a newcomer to type, typed."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from tests.system.test_demo import Demo

TOP = Path(__file__).parents[2]
README = (TOP / "README.md").read_text()
COMMANDS = [
    line.split("  #")[0].strip()
    for block in re.findall(r"```sh\n(.*?)```", README, re.S)
    for line in block.splitlines()
]
PNEUFORCE = [line for line in COMMANDS if "pneuforce " in line]
MBPOLL = [line for line in COMMANDS if line.startswith("mbpoll")]
REFUSED = re.compile(r"\b12\.5$")


@pytest.fixture(scope="module")
def demo():
    started = Demo("--seconds", "120")
    started.until_holding()
    yield started
    started.process.terminate()
    started.process.communicate()


def typed(line, demo, folder):
    """The line as it is typed beside this demo: its own ports, this Python, and an end."""
    line = line.replace(".venv/bin/pneuforce", f"{sys.executable} -m instrument")
    line = line.replace("-p 5020", f"-p {demo.modbus_port}").replace(
        "/tmp/pneuforce-rig", str(folder / "rig")
    )
    if "watch modbus" in line:
        line += f" --port {demo.modbus_port}"
    if "watch can" in line:
        line += f" --port {demo.can_port}"
    return line


def test_the_readme_has_commands():
    assert len(PNEUFORCE) >= 8
    assert len(MBPOLL) >= 3


def test_every_pneuforce_command_runs(demo, tmp_path):
    endless = [line for line in PNEUFORCE if re.search(r"pneuforce (run|sim)\b", line)]
    for line in PNEUFORCE:
        if line in endless:
            continue
        done = subprocess.run(
            typed(line, demo, tmp_path), shell=True, cwd=tmp_path, capture_output=True, text=True, timeout=30
        )
        assert done.returncode == 0, (line, done.stderr)
    rig, host = sorted(endless, key=lambda line: " run " in line)
    with subprocess.Popen(shlex.split(typed(rig, demo, tmp_path)), stdout=subprocess.PIPE, text=True) as sim:
        sim.stdout.readline()
        file = tmp_path / "instrument.toml"
        file.write_text(f'[rig]\nport = "{tmp_path}/rig"\n[modbus]\nenabled = false\n')
        running = subprocess.Popen(
            shlex.split(typed(host, demo, tmp_path)), cwd=tmp_path, stderr=subprocess.PIPE, text=True
        )
        said = running.stderr.readline()
        running.terminate()
        assert "answered" in said, said
        assert running.wait(3) == 0
        running.stderr.close()
        sim.terminate()


def test_every_mbpoll_line_does_what_its_comment_says(demo, tmp_path):
    for line in MBPOLL:
        done = subprocess.run(
            typed(line, demo, tmp_path), shell=True, cwd=tmp_path, capture_output=True, text=True, timeout=30
        )
        assert (done.returncode == 0) == (not REFUSED.search(line)), (line, done.stderr)
