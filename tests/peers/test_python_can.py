"""Tests of the CAN hub with the programs of python-can."""

import os
import pty
import signal
import subprocess
import sys
from contextlib import contextmanager, suppress

import can
import pytest

from pneuforce.registers.can.bus import CanAddress
from pneuforce.registers.can.frames import decode_frame
from pneuforce.registers.can.node import CanNode
from pneuforce.registers.can.options import CanOptions
from pneuforce.registers.can.wire import CanFrame
from tests.registers.can.bus_helpers import message, opened_connection, python_can_client, received_messages
from tests.registers.can.conftest import hub_process, no_frame_expiry, wait_for  # noqa: F401
from tests.registers.can.fake_source import FakeSource

pytestmark = pytest.mark.usefixtures("no_frame_expiry")


@pytest.fixture
def port():
    with hub_process() as (port, _):
        yield port


def hub_at(port, bus=""):
    """Return the command-line options with which a program of python-can connects to the hub."""
    options = {
        "interface": ["socketcand"],
        "channel": ["can0"],
        "bus-kwargs": ["host=127.0.0.1", f"port={port}"],
    }
    return [argument for name, values in options.items() for argument in (f"--{bus}{name}", *values)]


@contextmanager
def program(name, *arguments, end=signal.SIGINT, **popen_options):
    """Run a program of python-can, and end it with a signal."""
    running = subprocess.Popen(
        [sys.executable, "-u", "-m", f"can.{name}", *arguments],
        **({"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT} | popen_options),
    )
    try:
        yield running
        running.send_signal(end)
        running.wait(60)
    finally:
        running.kill()
        running.wait()
        if running.stdout is not None:
            running.stdout.close()


def wait_for_output(running, text):
    """Read the output of a program until a line contains `text`."""
    while (line := running.stdout.readline()) and text not in line:
        pass
    assert line


def frames_of_a_node(count):
    """Return the frames that a node sends while its force increases."""
    node, frames = CanNode(rig := FakeSource(), CanOptions(force_rate_hz=500)), []
    while len(frames) < count:
        step = len(frames)
        rig.set(force_n=step / 1000)
        frames += node.on_sample(step * 0.002) + node.tick(step * 0.002)
    return frames


@pytest.mark.parametrize("suffix", ["log", "asc"])
def test_the_logger_records_the_frames_of_a_node(port, tmp_path, suffix):
    file, frames = tmp_path / f"bus.{suffix}", frames_of_a_node(3000)
    at = CanAddress(interface="socketcand", port=port)
    with opened_connection(at) as bus, program("logger", *hub_at(port), "-f", str(file)) as logger:
        wait_for_output(logger, b"Connected to")
        for number, frame in enumerate(frames, start=1):
            bus.send(frame)
            if number % 100 == 0:  # the transmit queue holds 256 frames
                wait_for(lambda sent=number: bus.counters.sent == sent)
        wait_for(lambda: file.stat().st_size > 20_000)
    logged = [CanFrame(m.arbitration_id, bytes(m.data)) for m in can.LogReader(file)]
    assert len(logged) > 200
    assert logged == frames[: len(logged)]
    assert {decode_frame(frame, 5)[0].name for frame in logged} >= {"Force", "State", "Status", "Heartbeat"}


def test_the_player_replays_a_recording_to_the_hub(port, tmp_path):
    file, received = tmp_path / "bus.log", []
    with can.CanutilsLogWriter(file) as writer:
        for number in range(500):
            writer(message(number, timestamp=1.0 + number / 1000))
    with opened_connection(CanAddress(interface="socketcand", port=port), received.append):
        with program("player", *hub_at(port), "--gap", "0.0001", str(file)) as player:
            player.communicate(timeout=60)
            assert player.returncode == 0
        wait_for(lambda: len(received) == 500)
    assert [int.from_bytes(frame.data, "little") for frame in received] == list(range(500))


def test_the_viewer_shows_the_frames(port):
    screen, terminal_end = pty.openpty()
    terminal = {
        "stdin": terminal_end,
        "stdout": terminal_end,
        "stderr": terminal_end,
        "env": os.environ | {"TERM": "xterm"},
    }
    os.set_blocking(screen, False)
    shown = b""
    at = CanAddress(interface="socketcand", port=port)
    with opened_connection(at) as bus, program("viewer", *hub_at(port), end=signal.SIGTERM, **terminal):

        def is_shown():
            nonlocal shown
            bus.send(CanFrame(0x185, bytes.fromhex("D2040000000000AB")))
            with suppress(BlockingIOError):
                shown += os.read(screen, 65536)
            return b"0x185" in shown and b"D2 04" in shown

        wait_for(is_shown)
    os.close(screen)
    os.close(terminal_end)


def test_a_bridge_joins_two_hubs(port):
    with hub_process() as (other_port, _):
        both = [*hub_at(port, "bus1-"), *hub_at(other_port, "bus2-")]
        at, other = (CanAddress(interface="socketcand", port=p) for p in (port, other_port))
        with program("bridge", *both), python_can_client(at) as first, python_can_client(other) as second:
            wait_for(lambda: first.send(message(1)) or second.recv(0.05))
            second.send(message(2, arbitration_id=0x185))
            numbers = {(m.arbitration_id, m.data[0]) for m in received_messages(first, 1)}
    assert numbers == {(0x185, 2)}
