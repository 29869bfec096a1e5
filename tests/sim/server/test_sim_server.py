"""Tests of the simulator process through its serial port and its control port."""

import json
import os
import signal
import socket
import subprocess
import sys
import time
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest
import serial

from pneuforce.instrument.cli.terminal.exit_codes import ExitCode
from pneuforce.protocol.frames import (
    BAUD,
    BoardState,
    Command,
    CommandFlag,
    FrameDecoder,
    Hello,
    Identify,
    Mode,
    Sample,
    encode,
)
from tests.system.waiting import wait_for

SERVE = (
    "from pneuforce.sim.server.server import SimulatorOptions, serve; "
    "serve(SimulatorOptions(link={link!r}, hand={hand}))"
)


@contextmanager
def simulator(link, hand=True):
    """Run a simulator. Yield the process and the ports that it printed."""
    process = subprocess.Popen(
        [sys.executable, "-c", SERVE.format(link=str(link), hand=hand)], stdout=subprocess.PIPE, text=True
    )
    try:
        yield process, json.loads(process.stdout.readline())
    finally:
        process.terminate()
        process.wait(60)
        process.stdout.close()


class MinimalHost:
    """Minimal host process: sends commands and decodes frames."""

    def __init__(self, port):
        self.port = serial.Serial(port, BAUD, timeout=0.01, exclusive=True)
        self.decoder = FrameDecoder.for_board_frames()
        self.frames = []
        self.command = None
        self._sequence = 0
        self._sent_s = 0.0

    def send(self, message):
        self._sequence += 1
        self.port.write(encode(message, self._sequence))

    def run(self, seconds, until=lambda: False):
        deadline_s = time.monotonic() + seconds
        while time.monotonic() < deadline_s:
            if self.command and time.monotonic() - self._sent_s > 0.05:
                self._sent_s = time.monotonic()
                self.send(self.command)
            self.frames += self.decoder.feed(self.port.read(self.port.in_waiting or 1))
            if until():
                return True
        return False

    @property
    def samples(self):
        return [f for f in self.frames if isinstance(f.message, Sample)]

    def in_state(self, state):
        return bool(self.frames) and getattr(self.frames[-1].message, "state", None) == state


class ControlClient:
    """Client of the control port."""

    def __init__(self, port):
        self.connection = socket.create_connection(("127.0.0.1", port), timeout=5)
        self.lines = self.connection.makefile("r")

    def send(self, *requests):
        for request in requests:
            line = request if isinstance(request, bytes) else json.dumps(request).encode()
            self.connection.sendall(line + b"\n")

    def read(self):
        return json.loads(self.lines.readline())

    def close(self):
        self.lines.close()
        self.connection.close()


def kpa(samples):
    mean = sum(f.message.adc_sum for f in samples) / len(samples)
    return ((mean + 8) / 16384 - 0.04) / 0.018


def test_a_host_inflates_and_receives_contacts_and_each_truth_belongs_to_a_sample(tmp_path):
    with simulator(tmp_path / "rig") as (_, ports):
        control = ControlClient(ports["control"])
        control.send({"truth": 5})
        host = MinimalHost(ports["link"])
        host.send(Identify())
        assert host.run(2, lambda: host.samples)
        assert any(isinstance(f.message, Hello) for f in host.frames)

        host.command = Command(Mode.VENT)
        assert host.run(3, lambda: host.in_state(BoardState.VENTED))
        zero_kpa = kpa(host.samples[-100:])
        assert zero_kpa == pytest.approx(0.25, abs=0.02)

        flags = CommandFlag.ZEROED
        host.command = Command(Mode.HOLD, flags, 8000, round(zero_kpa * 1e3))
        assert host.run(8, lambda: host.in_state(BoardState.HOLDING))
        host.run(0.3)
        held_kpa = kpa(host.samples[-100:])
        assert held_kpa - zero_kpa == pytest.approx(8.0, abs=0.1)
        assert host.run(5, lambda: kpa(host.samples[-50:]) > held_kpa + 0.5)

        sequences = [f.sequence for f in host.samples]
        assert sequences == list(range(sequences[0], sequences[0] + len(sequences)))
        times_us = {f.sequence: f.message.board_time_us for f in host.samples}
        compared, truth = 0, {"sample": 0}
        while truth["sample"] < sequences[-1] - 5:
            truth = control.read()
            compared += 1
            assert times_us[truth["sample"] & 0xFFFF] == pytest.approx(truth["t_s"] * 1e6)
        assert compared > len(sequences) / 5 - 20
        assert truth["force_n"] > 0.5
        control.close()
        host.port.close()


def test_the_simulator_runs_in_real_time_and_one_second_costs_less_than_its_start(tmp_path):
    with simulator(tmp_path / "rig") as (process, ports):
        cost_of_start_s = cpu_s(process.pid)  # the same work on every computer
        host = MinimalHost(ports["port"])
        host.send(Identify())
        assert host.run(2, lambda: host.samples)
        used_s, start_s = cpu_s(process.pid), board_s(host)
        delays_s = [min_delay_s(host), min_delay_s(host)]
        while abs(delays_s[-1] - delays_s[-2]) > 0.01 and len(delays_s) < 8:
            delays_s.append(min_delay_s(host))
        assert abs(delays_s[-1] - delays_s[-2]) < 0.01, delays_s  # the clock rate error is below 2 %
        assert (cpu_s(process.pid) - used_s) / (board_s(host) - start_s) < cost_of_start_s
        host.port.close()


def board_s(host):
    return host.samples[-1].message.board_time_us * 1e-6


def min_delay_s(host):
    """Return the smallest difference [s] between test clock and board clock within half a second."""
    delays_s, end_s = [], time.monotonic() + 0.5
    while time.monotonic() < end_s:
        host.run(0.005)
        delays_s.append(time.monotonic() - board_s(host))
    return min(delays_s)


def cpu_s(pid):
    with open(f"/proc/{pid}/stat") as stat:
        fields = stat.read().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def test_the_simulator_continues_without_a_host_and_a_late_host_can_connect(tmp_path):
    with simulator(tmp_path / "rig") as (_, ports):
        first = MinimalHost(ports["port"])
        first.send(Identify())
        assert first.run(2, lambda: first.samples)
        first.port.close()
        time.sleep(0.7)  # until the buffer of the pseudo-terminal is full
        late = MinimalHost(ports["port"])
        late.send(Identify())
        assert late.run(2, lambda: any(isinstance(f.message, Hello) for f in late.frames))
        assert late.run(1, lambda: len(late.samples) > 100)
        assert late.samples[-1].sequence > 300
        late.port.close()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_the_simulator_with_less_computing_time_than_its_start_and_removes_the_link(
    tmp_path, number
):
    link = tmp_path / "rig"
    with simulator(link) as (process, ports):
        assert os.readlink(link) == ports["port"]
        start_s = cpu_s(process.pid)
        process.send_signal(number)
        ended_unreaped = os.WEXITED | os.WNOWAIT | os.WNOHANG
        wait_for(lambda: os.waitid(os.P_PID, process.pid, ended_unreaped), bool)
        assert cpu_s(process.pid) - start_s < start_s
        assert process.wait(0) == 0
        assert not os.path.lexists(link)


def ends_sooner_than_it_starts(link):
    """Start a simulator and end it by a signal. Return True if the start took longer than the end."""
    begun_s = time.monotonic()
    with simulator(link) as (process, _):
        signalled_s = time.monotonic()
        process.terminate()
        process.wait(60)
        return time.monotonic() - signalled_s < signalled_s - begun_s


def test_a_signal_ends_the_simulator_sooner_than_it_starts(tmp_path):
    assert any(ends_sooner_than_it_starts(tmp_path / "rig") for _ in range(5))  # a busy machine delays some


def test_an_old_link_is_replaced_and_any_other_file_is_kept(tmp_path):
    link = tmp_path / "rig"
    link.symlink_to("/dev/pts/987654")
    with simulator(link) as (_, ports):
        assert os.readlink(link) == ports["port"]
    link.write_text("precious")
    rejected = subprocess.run(
        [sys.executable, "-c", SERVE.format(link=str(link), hand=True)], capture_output=True, text=True
    )
    assert rejected.returncode != 0
    assert link.read_text() == "precious"


def test_a_link_in_use_is_rejected_and_the_link_of_a_killed_simulator_is_replaced(tmp_path):
    link = tmp_path / "rig"
    with simulator(link) as (process, ports):
        second = subprocess.run(
            [sys.executable, "-m", "pneuforce", "sim", "run", "--link", str(link)],
            capture_output=True,
            text=True,
            timeout=60,
        )
        assert (second.returncode, second.stdout) == (ExitCode.UNAVAILABLE, "")
        assert second.stderr.startswith(f"pneuforce: the simulator cannot start: {link} is in use")
        assert f"control port {ports['control']}" in second.stderr
        assert "--link" in second.stderr
        assert len(second.stderr.splitlines()) == 1
        assert os.readlink(link) == ports["port"]
        assert (tmp_path / "rig.control").read_text() == f"{ports['control']}\n"
        process.kill()
        process.wait(60)
        assert os.path.lexists(link)
        with simulator(link) as (_, again):
            assert os.readlink(link) == again["port"]
            assert (tmp_path / "rig.control").read_text() == f"{again['control']}\n"
    assert list(tmp_path.iterdir()) == []


def test_the_hand_follows_requests_and_invalid_requests_are_answered_with_an_error(tmp_path):
    with simulator(tmp_path / "rig", hand=False) as (_, ports):
        host = MinimalHost(ports["port"])
        host.send(Identify())
        assert host.run(2, lambda: host.samples)
        control = ControlClient(ports["control"])
        invalid = [
            b"hello", b"[]", b"{}", b"\xff\xfe", b'{"press": NaN}', b'{"press": Infinity}', b"[" * 3000,
            b'{"press": 1' + b"0" * 400 + b"}", {"press": -1}, {"press": 20.1}, {"press": True},
            {"press": "1"}, {"truth": -1}, {"truth": 1.5}, {"hand": 1}, {"release": False}, {"vent": True},
            {"press": 1, "hand": True},
            {"contact": 3}, {"contact": {"kind": "kick"}},
            {"contact": {"kind": "profile", "file": "/etc/passwd"}},
        ]  # fmt: skip
        control.send({"truth": 0}, *invalid)
        for _ in invalid:
            assert set(control.read()) == {"error"}
        control.send({"press": 2.5}, {"truth": 10})
        assert host.run(2, lambda: control.read()["force_n"] == 2.5)
        control.send({"release": True})
        assert host.run(2, lambda: control.read()["force_n"] == 0)
        control.send({"contact": {"kind": "hold", "force_n": 2.0, "angle_deg": 60}})
        assert host.run(2, lambda: control.read()["force_n"] == pytest.approx(1.0))
        assert control.read()["applied_n"] == pytest.approx(2.0)
        control.close()
        host.port.close()


def test_a_control_client_that_never_reads_is_disconnected_without_effect_on_others(tmp_path):
    with simulator(tmp_path / "rig") as (process, ports):
        host = MinimalHost(ports["port"])
        host.send(Identify())
        assert host.run(2, lambda: host.samples)
        silent = socket.socket()
        silent.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
        silent.connect(("127.0.0.1", ports["control"]))
        silent.settimeout(15)
        silent.sendall(b'{"truth": 0}\n' + b"x\n" * 40_000)
        listener = ControlClient(ports["control"])
        descriptors = Path(f"/proc/{process.pid}/fd")
        listener.send({"truth": 1})
        first = listener.read()["sample"]
        connected = len(list(descriptors.iterdir()))
        assert [listener.read()["sample"] for _ in range(500)] == list(range(first + 1, first + 501))
        host.run(0.1)
        sequences = [f.sequence for f in host.samples[-50:]]
        assert sequences[-1] - sequences[0] == 49
        until_s = time.monotonic() + 15
        while len(list(descriptors.iterdir())) >= connected and time.monotonic() < until_s:
            listener.read()
        with suppress(ConnectionResetError):
            while silent.recv(65536):
                pass
        listener.close()
        silent.close()
        host.port.close()


def test_many_connections_leak_no_file_descriptors(tmp_path):
    with simulator(tmp_path / "rig") as (process, ports):
        for _ in range(100):
            socket.create_connection(("127.0.0.1", ports["control"])).close()
        deadline_s = time.monotonic() + 3
        while len(os.listdir(f"/proc/{process.pid}/fd")) > 12 and time.monotonic() < deadline_s:
            time.sleep(0.02)
        assert len(os.listdir(f"/proc/{process.pid}/fd")) <= 12
