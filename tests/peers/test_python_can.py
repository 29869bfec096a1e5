"""python-can's own programs at the hub, started as their users do."""

import os
import pty
import signal
import subprocess
import sys
from contextlib import contextmanager, suppress

import can
import pytest

from registers.can.bus import BusAt
from registers.can.frames import read
from registers.can.node import CanNode
from registers.can.options import Options
from registers.can.wire import CanFrame
from tests.registers.can.buses import heard, message, opened, peer_on
from tests.registers.can.conftest import frames_stay_fresh, hub_process, wait_for  # noqa: F401
from tests.registers.can.rig import Rig

pytestmark = pytest.mark.usefixtures("frames_stay_fresh")


@pytest.fixture
def port():
    with hub_process() as (port, _):
        yield port


def hub_at(port, bus=""):
    """The options of these programs that mean our hub."""
    where = {
        "interface": ["socketcand"],
        "channel": ["can0"],
        "bus-kwargs": ["host=127.0.0.1", f"port={port}"],
    }
    return [word for name, values in where.items() for word in (f"--{bus}{name}", *values)]


@contextmanager
def program(name, *arguments, end=signal.SIGINT, **how):
    """One of python-can's programs, ended as its users end it."""
    running = subprocess.Popen(
        [sys.executable, "-u", "-m", f"can.{name}", *arguments],
        **({"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT} | how),
    )
    try:
        yield running
        running.send_signal(end)
        running.wait(20)
    finally:
        running.kill()
        running.wait()
        if running.stdout is not None:
            running.stdout.close()


def told(running, words):
    """Read what a program says until it has said this."""
    while (line := running.stdout.readline()) and words not in line:
        pass
    assert line


def frames_of_a_node(how_many):
    """What a node sends while its force goes up."""
    node, frames = CanNode(rig := Rig(), Options(force_rate_hz=500)), []
    while len(frames) < how_many:
        step = len(frames)
        rig.set(force_n=step / 1000)
        frames += node.on_sample(step * 0.002) + node.tick(step * 0.002)
    return frames


@pytest.mark.parametrize("suffix", ["log", "asc"])
def test_the_logger_keeps_what_a_node_sends(port, tmp_path, suffix):
    file, frames = tmp_path / f"bus.{suffix}", frames_of_a_node(3000)
    at = BusAt(interface="socketcand", port=port)
    with opened(at) as bus, program("logger", *hub_at(port), "-f", str(file)) as logger:
        told(logger, b"Connected to")
        for number, frame in enumerate(frames, start=1):
            bus.send(frame)
            if number % 100 == 0:  # the outbox holds 256
                wait_for(lambda sent=number: bus.counters.sent == sent)
        wait_for(lambda: file.stat().st_size > 20_000)
    kept = [CanFrame(m.arbitration_id, bytes(m.data)) for m in can.LogReader(file)]
    assert len(kept) > 200
    assert kept == frames[: len(kept)]
    assert {read(frame, 5)[0].name for frame in kept} >= {"Force", "State", "Status", "Heartbeat"}


def test_the_player_replays_a_recording_to_us(port, tmp_path):
    file, got = tmp_path / "bus.log", []
    with can.CanutilsLogWriter(file) as writer:
        for number in range(500):
            writer(message(number, timestamp=1.0 + number / 1000))
    with opened(BusAt(interface="socketcand", port=port), got.append):
        with program("player", *hub_at(port), "--gap", "0.0001", str(file)) as player:
            player.communicate(timeout=60)
            assert player.returncode == 0
        wait_for(lambda: len(got) == 500)
    assert [int.from_bytes(frame.data, "little") for frame in got] == list(range(500))


def test_the_viewer_shows_our_frames(port):
    ours, theirs = pty.openpty()
    terminal = {"stdin": theirs, "stdout": theirs, "stderr": theirs, "env": os.environ | {"TERM": "xterm"}}
    os.set_blocking(ours, False)
    shown = b""
    at = BusAt(interface="socketcand", port=port)
    with opened(at) as bus, program("viewer", *hub_at(port), end=signal.SIGTERM, **terminal):

        def sees():
            nonlocal shown
            bus.send(CanFrame(0x185, bytes.fromhex("D2040000000000AB")))
            with suppress(BlockingIOError):
                shown += os.read(ours, 65536)
            return b"0x185" in shown and b"D2 04" in shown

        wait_for(sees)
    os.close(ours)
    os.close(theirs)


def test_a_bridge_joins_two_hubs(port):
    with hub_process() as (other_port, _):
        both = [*hub_at(port, "bus1-"), *hub_at(other_port, "bus2-")]
        at, other = (BusAt(interface="socketcand", port=p) for p in (port, other_port))
        with program("bridge", *both), peer_on(at) as here, peer_on(other) as there:
            wait_for(lambda: here.send(message(1)) or there.recv(0.05))
            there.send(message(2, arbitration_id=0x185))
            numbers = {(m.arbitration_id, m.data[0]) for m in heard(here, 1)}
    assert numbers == {(0x185, 2)}
