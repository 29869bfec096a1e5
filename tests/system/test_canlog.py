"""`pneuforce canlog` beside a running instrument, its files read by python-can and cantools."""

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

from tests.system.waiting import wait_for
from tests.typed import pneuforce
from teststand.children import Child

DBC = cantools.database.load_file(Path(__file__).parents[2] / "docs/pneuforce.dbc", strict=True)
FORCE_ID = DBC.get_message_by_name("Force").frame_id
FOREIGN = [
    can.Message(arbitration_id=0x123, data=b"\x01\x02\x03", is_extended_id=False),
    can.Message(arbitration_id=0x18DAF110, data=bytes(8), is_extended_id=True),
]
ENDINGS = {"candump": "log", "asc": "asc", "blf": "blf"}
STRANGERS = {message.arbitration_id for message in FOREIGN}


@contextmanager
def recording(port, *words, **how):
    command = [sys.executable, "-m", "instrument", "canlog", "--port", str(port), *map(str, words)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, **how) as process:
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


def waited_for(file, frames):
    wait_for(
        lambda: file.exists() and len(re.findall(rb" 185[# ]", file.read_bytes())),
        lambda seen: seen >= frames,
    )


def test_ctrl_c_leaves_files_with_every_frame_on_the_bus_that_others_read(lasting_stack, tmp_path):
    files = {form: tmp_path / f"press.{ending}" for form, ending in ENDINGS.items()}
    with ExitStack() as recordings:
        processes = {
            form: recordings.enter_context(
                recording(lasting_stack.can_port, "--format", form, "--output", file)
            )
            for form, file in files.items()
        }
        wait_for(lambda: all(file.exists() for file in files.values()), bool)
        with lasting_stack.robot() as robot:
            for message in FOREIGN:
                robot.send(message)
            for _ in range(60):
                assert robot.recv(2.0)
        for process in processes.values():
            process.send_signal(signal.SIGINT)
        said = {form: process.communicate(timeout=5)[1] for form, process in processes.items()}
    for form, file in files.items():
        messages = recorded(file)
        ended = processes[form].returncode, said[form].split(" on ")[0]
        assert ended == (0, f"pneuforce: {len(messages)} frames")
        assert_whole(messages)


def assert_whole(messages):
    """All that was sent, in its order, and the instrument's frames are the DBC's."""
    strangers = [m for m in messages if m.arbitration_id in STRANGERS]
    assert [(m.arbitration_id, m.is_extended_id, bytes(m.data)) for m in strangers] == [
        (m.arbitration_id, m.is_extended_id, bytes(m.data)) for m in FOREIGN
    ]
    assert len(forces(messages)) > 20
    assert is_unbroken(messages)
    assert all(a.timestamp <= b.timestamp for a, b in pairwise(messages))
    for message in messages:
        if message.arbitration_id not in STRANGERS:
            DBC.decode_message(message.arbitration_id, message.data)


@pytest.mark.parametrize("form", ["candump", "asc"])
def test_a_recording_that_is_killed_keeps_all_frames_up_to_then(lasting_stack, tmp_path, form):
    file = tmp_path / f"press.{ENDINGS[form]}"
    with recording(lasting_stack.can_port, "--format", form, "--output", file) as process:
        waited_for(file, 30)
        process.kill()
        process.wait()
    assert file.read_bytes().endswith(b"\n")
    messages = recorded(file)
    assert len(forces(messages)) >= 30
    assert is_unbroken(messages)


def test_a_file_that_cannot_grow_ends_the_recording_in_a_sentence(lasting_stack, tmp_path):
    file = tmp_path / "press.log"
    limit = {"preexec_fn": lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))}
    with recording(lasting_stack.can_port, "--output", file, **limit) as process:
        _, said = process.communicate(timeout=10)
    assert process.returncode == 2
    assert said.startswith(f"pneuforce: {file} cannot be written: File too large; ")
    assert "Traceback" not in said
    whole = file.read_text().rpartition("\n")[0].splitlines()
    assert f"{len(whole)} frames are in it" in said


def test_no_room_on_stdout_is_a_sentence(lasting_stack):
    with open("/dev/full", "w") as full, recording(lasting_stack.can_port, stdout=full) as process:
        _, said = process.communicate(timeout=10)
    assert process.returncode == 2
    assert said == "pneuforce: stdout cannot be written: No space left on device; 0 frames are in it\n"


@pytest.fixture
def hub():
    with Child("hub", ["registers.can.hub", "--port", "0"]) as started:
        yield started


def test_a_bus_that_goes_away_ends_the_recording_in_a_sentence(hub, tmp_path):
    file = tmp_path / "press.log"
    with recording(hub.ready()["port"], "--output", file) as process:
        wait_for(file.exists, bool)
        hub.stop()
        _, said = process.communicate(timeout=10)
    assert (process.returncode, len(said.splitlines())) == (2, 1)
    assert "is an instrument running there?" in said


def test_what_cannot_be_recorded_is_said_and_leaves_no_file(lasting_stack, tmp_path):
    there, absent = tmp_path / "there.log", tmp_path / "absent.log"
    there.write_text("precious")

    def refusal(*words, port=lasting_stack.can_port):
        done = pneuforce("canlog", "--seconds", "1", "--port", port, *words)
        assert (done.returncode, done.stdout) == (2, "")
        return done.stderr

    assert refusal("--output", there) == f"pneuforce: {there} is there already: choose another name\n"
    assert there.read_text() == "precious"
    assert refusal("--format", "blf") == "pneuforce: blf needs a file: give it with --output\n"
    assert "cannot be made: No such file or directory" in refusal("--output", tmp_path / "no" / "x.log")
    assert "is an instrument running there?" in refusal("--output", absent, port=1)
    assert "CAN interface 'foo' not supported" in refusal("--output", absent, "--interface", "foo")
    assert not absent.exists()


def test_a_recording_is_played_again_to_another_bus(lasting_stack, hub, tmp_path):
    file = tmp_path / "press.log"
    with recording(lasting_stack.can_port, "--output", file) as process:
        waited_for(file, 30)
        process.terminate()
        process.wait(5)
    messages, port = recorded(file), hub.ready()["port"]
    place = {"interface": "socketcand", "host": "127.0.0.1", "port": port, "channel": "can0"}
    with can.Bus(**place, tcp_tune=True) as listener:
        to = ["--bus-kwargs", "host=127.0.0.1", f"port={port}", "-i", "socketcand", "-c", "can0"]
        player = [sys.executable, "-m", "can.player", *to, str(file)]
        subprocess.run(player, check=True, capture_output=True, timeout=30)
        heard = [listener.recv(1.0) for _ in messages]
    assert [(m.arbitration_id, bytes(m.data)) for m in heard if m] == [
        (m.arbitration_id, bytes(m.data)) for m in messages
    ]
