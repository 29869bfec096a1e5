"""Every command and program that README, first steps, rules and PLC guide tell a newcomer to type, typed."""

import re
import shlex
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path
from threading import Timer

import pytest

from tests.system.test_demo import Demo
from tests.system.waiting import wait_for
from tests.tools import needs

TOP = Path(__file__).parents[2]
README = (TOP / "README.md").read_text()
START, RULES, PLC = ((TOP / "docs" / name).read_text() for name in ("start.md", "rules.md", "plc.md"))


def commands(text):
    """Command and comment of each line in the shell blocks of a document."""
    lines = [line for block in re.findall(r"```sh\n(.*?)```", text, re.S) for line in block.splitlines()]
    return [tuple(part.strip() for part in (line + "  #").split("  #")[:2]) for line in lines]


def mbpoll_lines(text):
    return [(line, comment) for line, comment in commands(text) if line.startswith("mbpoll")]


PNEUFORCE = [line for line, _ in commands(README) if "pneuforce " in line]
#: So begins the comment of a line that the instrument does not accept.
REFUSED = "refused"
#: "until [25] is 6" in a comment: the line is typed again and again until mbpoll prints that.
UNTIL = re.compile(r"\[(\d+)\] is (\d+)")
READ = re.compile(r"\[(\d+)\]:\s+(\d+)")
FORCE = re.compile(r"-?\d\.\d{3} ± \d\.\d{3} N\n")


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    """One that nobody but these tests finds: `pneuforce record` looks where temporary files are."""
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("TMPDIR", str(tmp_path_factory.mktemp("demo")))
        started = Demo("--seconds", "300")
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


@contextmanager
def started(line, folder):
    """A program that runs until it is killed: a test that fails must not wait for it."""
    process = subprocess.Popen(
        shlex.split(line), cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def test_the_documents_have_commands():
    assert len(PNEUFORCE) >= 8
    assert len(mbpoll_lines(README)) >= 5
    assert len(mbpoll_lines(START)) >= 10
    assert len(mbpoll_lines(RULES)) >= 6
    assert len(mbpoll_lines(PLC)) >= 20


def ended_well(line, process):
    _, complaints = process.communicate(timeout=30)
    assert process.returncode == 0, (line, complaints)


def test_every_pneuforce_command_runs(demo, tmp_path):
    endless = [line for line in PNEUFORCE if re.search(r"pneuforce (run|sim)\b", line)]
    lasting = [line for line in PNEUFORCE if re.search(r"pneuforce (watch|record)\b", line)]
    of_recording = [line for line in PNEUFORCE if re.search(r"pneuforce (replay|plot|export)\b", line)]

    def begun(line):
        return subprocess.Popen(
            typed(line, demo, tmp_path),
            shell=True,
            cwd=tmp_path,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )

    going_on = [(line, begun(line)) for line in lasting]  # seconds each: the others run meanwhile
    for line in PNEUFORCE:
        if line not in endless + lasting + of_recording:
            ended_well(line, begun(line))
    for line, process in going_on:
        ended_well(line, process)
    for line, process in [(line, begun(line)) for line in of_recording]:
        ended_well(line, process)
    rig, host = sorted(endless, key=lambda line: " run " in line)
    with started(typed(rig, demo, tmp_path), tmp_path) as sim:
        sim.stdout.readline()
        file = tmp_path / "instrument.toml"
        file.write_text(f'[rig]\nport = "{tmp_path}/rig"\n[modbus]\nenabled = false\n')
        with started(typed(host, demo, tmp_path), tmp_path) as running:
            said = running.stderr.readline() + running.stderr.readline()  # the first: no bus is enabled
            running.terminate()
            assert "answered" in said, said
            assert running.wait(3) == 0


def test_the_python_program_prints_forces(demo, tmp_path):
    [program] = re.findall(r"```python\n(.*?)```", README, re.S)
    assert "port=29536" in program
    file = tmp_path / "force.py"
    file.write_text(program.replace("port=29536", f"port={demo.can_port}"))
    with (
        open(tmp_path / "said", "w") as complaints,
        subprocess.Popen(
            [sys.executable, "-u", str(file)], cwd=TOP, stdout=subprocess.PIPE, stderr=complaints, text=True
        ) as running,
    ):
        deadline = Timer(30, running.kill)
        deadline.start()
        lines = [running.stdout.readline() for _ in range(20)]
        deadline.cancel()
        running.kill()
    assert all(FORCE.fullmatch(line) for line in lines), (lines, (tmp_path / "said").read_text())


@needs("mbpoll")
@pytest.mark.parametrize("text", [README, START, RULES, PLC], ids=["README", "start", "rules", "plc"])
def test_every_mbpoll_line_does_what_its_comment_says(demo, tmp_path, text):
    for line, comment in mbpoll_lines(text):
        command = shlex.split(typed(line, demo, tmp_path))
        done = wait_for(
            lambda command=command: subprocess.run(command, capture_output=True, text=True, timeout=30),
            lambda done, comment=comment: set(UNTIL.findall(comment)) <= set(READ.findall(done.stdout)),
        )
        assert (done.returncode == 0) == (not comment.startswith(REFUSED)), (line, done.stderr)


@needs("mbpoll")
def test_the_recipes_end_with_the_balloon_held(demo):
    demo.until_holding()
