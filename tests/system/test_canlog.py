"""Tests of `pneuforce canlog` with a running instrument. python-can and cantools read the files."""

import re
import resource
import signal
import subprocess
import sys
from contextlib import ExitStack, contextmanager
from itertools import pairwise
from pathlib import Path

import can
import cantools
import pytest

from pneuforce.teststand.child_process import ChildProcess
from tests.command_runner import pneuforce
from tests.system.waiting import wait_for

DBC = cantools.database.load_file(Path(__file__).parents[2] / "docs/pneuforce.dbc", strict=True)
FORCE_ID = DBC.get_message_by_name("Force").frame_id
FOREIGN = [
    can.Message(arbitration_id=0x123, data=b"\x01\x02\x03", is_extended_id=False),
    can.Message(arbitration_id=0x18DAF110, data=bytes(8), is_extended_id=True),
]
ENDINGS = {"candump": "log", "asc": "asc", "blf": "blf"}
FOREIGN_IDS = {message.arbitration_id for message in FOREIGN}


@contextmanager
def recording(port, *words, **options):
    command = [sys.executable, "-m", "pneuforce", "canlog", "--port", str(port), *map(str, words)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, **options) as process:
        try:
            yield process
        finally:
            process.kill()


def recorded(file):
    with can.LogReader(file) as reader:
        return list(reader)


def forces(messages):
    return [
        DBC.decode_message(FORCE_ID, message.data)
        for message in messages
        if message.arbitration_id == FORCE_ID
    ]


def is_unbroken(messages):
    counters = [int(force["counter"]) for force in forces(messages)]
    return all((after - before) & 0xFF == 1 for before, after in pairwise(counters))


def wait_for_frames(file, frames):
    wait_for(
        lambda: file.exists() and len(re.findall(rb" 185[# ]", file.read_bytes())),
        lambda seen: seen >= frames,
    )


def test_ctrl_c_leaves_complete_files_in_all_formats(shared_stack, tmp_path):
    files = {form: tmp_path / f"press.{ending}" for form, ending in ENDINGS.items()}
    with ExitStack() as recordings:
        processes = {
            form: recordings.enter_context(
                recording(shared_stack.can_port, "--format", form, "--output", file)
            )
            for form, file in files.items()
        }
        wait_for(lambda: all(file.exists() for file in files.values()), bool)
        with shared_stack.robot() as robot:
            for message in FOREIGN:
                robot.send(message)
            for _ in range(60):
                assert robot.recv(2.0)
        for process in processes.values():
            process.send_signal(signal.SIGINT)
        stderr = {form: process.communicate(timeout=60)[1] for form, process in processes.items()}
    for form, file in files.items():
        messages = recorded(file)
        ended = processes[form].returncode, stderr[form].split(" on ")[0]
        assert ended == (0, f"pneuforce: {len(messages)} frames")
        assert_complete(messages)


def assert_complete(messages):
    """Assert that all frames are in order, and that the DBC decodes the frames of the instrument."""
    foreign = [m for m in messages if m.arbitration_id in FOREIGN_IDS]
    assert [(m.arbitration_id, m.is_extended_id, bytes(m.data)) for m in foreign] == [
        (m.arbitration_id, m.is_extended_id, bytes(m.data)) for m in FOREIGN
    ]
    assert len(forces(messages)) > 20
    assert is_unbroken(messages)
    assert all(a.timestamp <= b.timestamp for a, b in pairwise(messages))
    for message in messages:
        if message.arbitration_id not in FOREIGN_IDS:
            DBC.decode_message(message.arbitration_id, message.data)


@pytest.mark.parametrize("form", ["candump", "asc"])
def test_a_killed_recording_contains_all_frames_up_to_then(shared_stack, tmp_path, form):
    file = tmp_path / f"press.{ENDINGS[form]}"
    with recording(shared_stack.can_port, "--format", form, "--output", file) as process:
        wait_for_frames(file, 30)
        process.kill()
        process.wait()
    assert file.read_bytes().endswith(b"\n")
    messages = recorded(file)
    assert len(forces(messages)) >= 30
    assert is_unbroken(messages)


def test_a_file_that_cannot_grow_ends_the_recording_with_an_error(shared_stack, tmp_path):
    file = tmp_path / "press.log"
    limit = {"preexec_fn": lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))}
    with recording(shared_stack.can_port, "--output", file, **limit) as process:
        _, stderr = process.communicate(timeout=60)
    assert process.returncode == 74
    assert stderr.startswith(f"pneuforce: {file} cannot be written: File too large; ")
    assert "Traceback" not in stderr
    complete_lines = file.read_text().rpartition("\n")[0].splitlines()
    assert f" {len(complete_lines)} frames" in stderr


def test_a_full_stdout_is_reported_in_one_sentence(shared_stack):
    with open("/dev/full", "w") as full, recording(shared_stack.can_port, stdout=full) as process:
        _, stderr = process.communicate(timeout=60)
    assert process.returncode == 74
    assert stderr.startswith("pneuforce: stdout cannot be written: No space left on device; ")
    assert len(stderr.splitlines()) == 1


@pytest.fixture
def hub():
    with ChildProcess("hub", ["pneuforce.registers.can.hub", "--port", "0"]) as started:
        yield started


def test_a_lost_bus_ends_the_recording_with_an_error(hub, tmp_path):
    file = tmp_path / "press.log"
    with recording(hub.ready()["port"], "--output", file) as process:
        wait_for(file.exists, bool)
        hub.stop()
        _, stderr = process.communicate(timeout=60)
    assert (process.returncode, len(stderr.splitlines())) == (69, 1)
    assert "is an instrument running there?" in stderr


def test_a_rejected_recording_leaves_no_file(shared_stack, tmp_path):
    existing, absent = tmp_path / "existing.log", tmp_path / "absent.log"
    existing.write_text("precious")

    def error_of(*words, port=shared_stack.can_port, code=2):
        done = pneuforce("canlog", "--seconds", "1", "--port", port, *words)
        assert (done.returncode, done.stdout) == (code, "")
        return done.stderr

    assert f"{existing} already exists" in error_of("--output", existing)
    assert existing.read_text() == "precious"
    assert "--output" in error_of("--format", "blf")
    assert "cannot be written: No such file or directory: create the folder" in error_of(
        "--output", tmp_path / "no" / "x.log"
    )
    assert "is an instrument running there?" in error_of("--output", absent, port=1, code=69)
    assert "python-can has no interface 'foo'" in error_of("--output", absent, "--interface", "foo")
    assert not absent.exists()


def test_a_recording_can_be_played_to_another_bus(shared_stack, hub, tmp_path):
    file = tmp_path / "press.log"
    with recording(shared_stack.can_port, "--output", file) as process:
        wait_for_frames(file, 30)
        process.terminate()
        process.wait(60)
    messages, port = recorded(file), hub.ready()["port"]
    place = {"interface": "socketcand", "host": "127.0.0.1", "port": port, "channel": "can0"}
    with can.Bus(**place, tcp_tune=True) as listener:
        to = ["--bus-kwargs", "host=127.0.0.1", f"port={port}", "-i", "socketcand", "-c", "can0"]
        player = [sys.executable, "-m", "can.player", *to, str(file)]
        subprocess.run(player, check=True, capture_output=True, timeout=60)
        received = [listener.recv(1.0) for _ in messages]
    assert [(m.arbitration_id, bytes(m.data)) for m in received if m] == [
        (m.arbitration_id, bytes(m.data)) for m in messages
    ]
