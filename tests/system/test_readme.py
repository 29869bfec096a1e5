"""Tests that run the commands and programs of README, tutorial, rules and guides as a reader types them."""

import re
import shlex
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path
from threading import Timer

import pytest

from pneuforce.registers.modbus.client import ModbusClient
from tests.system.test_demo import Demo
from tests.system.waiting import wait_for
from tests.tools import needs

TOP = Path(__file__).parents[2]
FILES = {"README": "README.md"} | {name: f"docs/{name}.md" for name in ("start", "rules", "plc")}
DOCUMENTS = {name: (TOP / file).read_text(encoding="utf-8") for name, file in FILES.items()}
ROBOT = (TOP / "docs/robot.md").read_text(encoding="utf-8")


def commands(text):
    """Return command and comment of each line in the shell blocks of a document."""
    lines = [line for block in re.findall(r"```sh\n(.*?)```", text, re.DOTALL) for line in block.splitlines()]
    return [tuple(part.strip() for part in (line + "  #").split("  #")[:2]) for line in lines]


def mbpoll_lines(text):
    return [(line, comment) for line, comment in commands(text) if line.startswith("mbpoll")]


def pneuforce_lines(text):
    return [line for line, _ in commands(text) if line.startswith(".venv/bin/pneuforce ")]


#: A comment that begins with this word marks a line that the instrument must reject.
REJECTED = "rejected"
#: A comment such as "until [25] is 6": the line is repeated until mbpoll prints this value.
UNTIL = re.compile(r"\[(\d+)\] is (\d+)")
READ = re.compile(r"\[(\d+)\]:\s+(\d+)")
FORCE = re.compile(r"-?\d\.\d{3} ± \d\.\d{3} N(, no contact)?\n")
#: Commands that run until they are stopped, that run for some seconds, and that read a recording.
ENDLESS = re.compile(r"pneuforce (run|sim run)\b")
FAULT = re.compile(r"pneuforce sim fault\b")  # `test_the_lost_rig_of_the_plc_guide` executes these lines
LASTING = re.compile(r"pneuforce (watch|record)\b")
ON_RECORDING = re.compile(r"pneuforce (replay|plot|export)\b")
#: The virtual serial line of the PLC guide has its own test.
SERIAL_LINE = "/tmp/line-plc"


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    """Return a demo in its own temporary folder, where only these tests find the demo."""
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("TMPDIR", str(tmp_path_factory.mktemp("demo")))
        started_demo = Demo("--seconds", "300")
        started_demo.until_holding()
        yield started_demo
        started_demo.process.terminate()
        started_demo.process.communicate()


def adapted(line, demo, folder):
    """Return a shell line with the ports of the demo, the Python of the tests, and files in `folder`.

    Commands that end after some seconds end after one second.
    """
    line = line.replace(".venv/bin/pneuforce", f"{sys.executable} -m pneuforce")
    line = line.replace("-p 5020", f"-p {demo.modbus_port}").replace(
        "/tmp/pneuforce-rig", str(folder / "rig")
    )
    line = re.sub(r"--seconds \d+", "--seconds 1", line)
    if "watch modbus" in line and "--device" not in line:
        line += f" --port {demo.modbus_port}"
    if "watch can" in line:
        line += f" --port {demo.can_port}"
    return line


def begin(line, demo, folder):
    return subprocess.Popen(
        adapted(line, demo, folder),
        shell=True,
        cwd=folder,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )


def check_success(line, process):
    _, stderr = process.communicate(timeout=60)
    assert process.returncode == 0, (line, stderr)


@contextmanager
def started(line, folder):
    """Run a command, and kill it at the end, so that a failed test does not wait for it."""
    process = subprocess.Popen(
        shlex.split(line), cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def test_the_documents_have_commands():
    least_pneuforce = {"README": 5, "start": 8, "rules": 0, "plc": 1}
    least_mbpoll = {"README": 0, "start": 10, "rules": 6, "plc": 20}
    for name, text in DOCUMENTS.items():
        assert len(pneuforce_lines(text)) >= least_pneuforce[name], name
        assert len(mbpoll_lines(text)) >= least_mbpoll[name], name


@pytest.mark.parametrize("name", [name for name, text in DOCUMENTS.items() if pneuforce_lines(text)])
def test_every_pneuforce_command_runs(demo, tmp_path, name):
    lines = [line for line in pneuforce_lines(DOCUMENTS[name]) if SERIAL_LINE not in line]
    lines = [line for line in lines if not ENDLESS.search(line) and not FAULT.search(line)]
    lasting = [line for line in lines if LASTING.search(line)]
    on_recording = [line for line in lines if ON_RECORDING.search(line)]
    running = [(line, begin(line, demo, tmp_path)) for line in lasting]  # these run in parallel to the others
    for line in lines:
        if line not in lasting + on_recording:
            check_success(line, begin(line, demo, tmp_path))
    for line, process in running:
        check_success(line, process)
    for line, process in [(line, begin(line, demo, tmp_path)) for line in on_recording]:
        check_success(line, process)


def test_an_instrument_runs_with_its_own_configuration(demo, tmp_path):
    endless = [line for line in pneuforce_lines(DOCUMENTS["start"]) if ENDLESS.search(line)]
    rig, host = sorted(endless, key=lambda line: "pneuforce run " in line)
    with started(adapted(rig, demo, tmp_path), tmp_path) as sim:
        sim.stdout.readline()
        file = tmp_path / "instrument.toml"
        file.write_text(f'[rig]\nport = "{tmp_path}/rig"\n[modbus]\nenabled = false\n')
        with started(adapted(host, demo, tmp_path), tmp_path) as running:
            lines = [running.stderr.readline() for _ in range(3)]  # no bus is enabled, the firmware, the rig
            running.terminate()
            assert any("answered" in line for line in lines), lines
            assert running.wait(60) == 0


@needs("socat")
def test_the_virtual_serial_line_of_the_plc_guide(demo, tmp_path):
    lines = [line for line, _ in commands(DOCUMENTS["plc"])]
    socat, host, watch = lines[(at := next(n for n, line in enumerate(lines) if "socat" in line)) : at + 3]
    assert SERIAL_LINE in watch
    configuration = re.search(r"```toml\n(\[rig\].*?)```", DOCUMENTS["plc"], re.DOTALL)[1]

    def local(text):
        return text.removesuffix(" &").replace("/tmp/", f"{tmp_path}/")

    file = tmp_path / "instrument.toml"
    file.write_text(local(configuration) + "[modbus]\nenabled = false\n")
    rig = f"{sys.executable} -m pneuforce sim run --link {tmp_path}/pneuforce-rig"
    with started(local(socat), tmp_path), started(rig, tmp_path) as sim:
        sim.stdout.readline()
        with started(adapted(local(host), demo, tmp_path), tmp_path) as instrument:
            instrument.stdout.readline()  # the line that reports that the buses are served
            command = shlex.split(adapted(local(watch), demo, tmp_path))
            done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    assert "sample_age" in done.stdout


def test_the_lost_rig_of_the_plc_guide(tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    pull, plug = [line for line in pneuforce_lines(DOCUMENTS["plc"]) if FAULT.search(line)]
    lost_rig = Demo("--seconds", "60")
    try:
        lost_rig.until_holding()
        port = next(
            found[1]
            for line in lost_rig.process.stdout
            if (found := re.search(r"control port of the simulator: (\d+)", line))
        )
        with ModbusClient.connect(port=lost_rig.modbus_port) as plc:
            for line, state, fault in ((pull, "tripped", 34), (plug, "holding", 0)):
                local = adapted(re.sub(r"(--control-port) \d+", rf"\1 {port}", line), lost_rig, tmp_path)
                subprocess.run(shlex.split(local), check=True, timeout=30)
                wait_for(plc.read, lambda v, state=state: v["state"] == state)
                assert plc.read_all()["first_out_fault"] == fault
    finally:
        lost_rig.process.kill()
        lost_rig.process.communicate()


def test_the_python_program_prints_forces(demo, tmp_path):
    [program] = [
        text for text in re.findall(r"```python\n(.*?)```", ROBOT, re.DOTALL) if '"port": 29536' in text
    ]
    file = tmp_path / "force.py"
    file.write_text(program.replace('"port": 29536', f'"port": {demo.can_port}'), encoding="utf-8")
    with (
        open(tmp_path / "stderr", "w") as stderr,
        subprocess.Popen(
            [sys.executable, "-u", str(file)], cwd=TOP, stdout=subprocess.PIPE, stderr=stderr, text=True
        ) as running,
    ):
        deadline = Timer(30, running.kill)
        deadline.start()
        lines = [running.stdout.readline() for _ in range(20)]
        deadline.cancel()
        running.kill()
    forces = [line for line in lines if FORCE.fullmatch(line)]
    others = [line for line in lines if line not in forces and not line.startswith("no force: ")]
    assert (len(forces) > 10, others) == (True, []), (lines, (tmp_path / "stderr").read_text())


@needs("mbpoll")
@pytest.mark.parametrize("name", [name for name, text in DOCUMENTS.items() if mbpoll_lines(text)])
def test_every_mbpoll_line_does_what_its_comment_says(demo, tmp_path, name):
    for line, comment in mbpoll_lines(DOCUMENTS[name]):
        command = shlex.split(adapted(line, demo, tmp_path))
        done = wait_for(
            lambda command=command: subprocess.run(command, capture_output=True, text=True, timeout=60),
            lambda done, comment=comment: set(UNTIL.findall(comment)) <= set(READ.findall(done.stdout)),
        )
        assert (done.returncode == 0) == (not comment.startswith(REJECTED)), (line, done.stderr)


@needs("mbpoll")
def test_the_recipes_end_with_the_balloon_held(demo):
    demo.until_holding()
