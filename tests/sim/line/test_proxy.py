"""Tests of the proxies: Modbus server behind a bad TCP line, host process behind a bad serial line."""

import asyncio
import contextlib
import socket
import time
from dataclasses import fields

import pytest

from pneuforce.instrument.core.controller import Instrument
from pneuforce.instrument.core.session import Session
from pneuforce.instrument.core.settings import Settings
from pneuforce.instrument.service.host.host import Host
from pneuforce.registers.modbus.mbap import encode_frame
from pneuforce.sim.line.line_noise import LineNoise
from pneuforce.sim.line.proxy import SerialProxy, TcpProxy
from pneuforce.sim.line.pty_link import PtyLink
from pneuforce.sim.server.client import SimulatorClient
from pneuforce.support.serial_port import SerialPort
from pneuforce.teststand.child_process import ChildProcess
from pneuforce.teststand.stack import free_port
from tests.instrument.instrument_harness import HOLD_8, PLC, VENT
from tests.registers.modbus.memory_source import MemorySource
from tests.registers.modbus.serving import (
    FORCE,
    FORCE_ANSWER,
    connected,
    eventually,
    read_answer,
    read_exactly,
    serving,
    still_answers,
)

TIMEOUT_S = 20.0


def simulator_at(link):
    return ChildProcess("simulator", ["pneuforce", "sim", "run", "--link", str(link), "--no-hand"])


@pytest.fixture(scope="module")
def server():
    with serving(MemorySource()) as server:
        yield server


@pytest.fixture
def proxy(server):
    with TcpProxy(("127.0.0.1", server.port)) as proxy:
        yield proxy


def through(proxy):
    return socket.create_connection(("127.0.0.1", proxy.port), timeout=TIMEOUT_S)


def test_a_request_in_late_pieces_is_answered_once_and_correctly(proxy):
    proxy.noise.max_chunk_bytes, proxy.noise.delay_s = 1, 0.02
    with through(proxy) as client:
        start_s = time.monotonic()
        for number in range(3):
            client.sendall(encode_frame(number, 1, FORCE))
            assert read_answer(client) == encode_frame(number, 1, FORCE_ANSWER).hex(" ")
        assert time.monotonic() - start_s >= 3 * 2 * 0.02


def test_bytes_of_a_stalled_line_arrive_in_order_after_the_stall(proxy):
    with through(proxy) as client:
        proxy.noise.stalled = True
        stream = b"".join(encode_frame(number, 1, FORCE) for number in range(50))
        client.sendall(stream)
        client.settimeout(0.1)
        with pytest.raises(TimeoutError):
            client.recv(1)
        client.settimeout(TIMEOUT_S)
        proxy.noise.stalled = False
        answers = b"".join(encode_frame(number, 1, FORCE_ANSWER) for number in range(50))
        assert read_exactly(client, len(answers)) == answers


def test_corrupt_requests_never_crash_the_server_and_leave_no_open_connection(server, proxy):
    proxy.noise.flipped_bits, proxy.noise.dropped, proxy.noise.inserted = 0.01, 0.01, 0.01
    for _ in range(100):
        with through(proxy) as client, contextlib.suppress(OSError):
            client.settimeout(0.02)
            client.sendall(b"".join(encode_frame(number, 1, FORCE) for number in range(5)))
            client.recv(4096)
    assert server.counters.invalid_frames > 10
    with connected(server) as clean:
        assert still_answers(clean)
    assert eventually(lambda: server.counters.clients == 0)


def test_a_connection_ends_for_both_sides_when_one_side_closes_it(server, proxy):
    with through(proxy) as client:
        client.sendall(encode_frame(1, 1, FORCE))
        read_answer(client)
        assert eventually(lambda: server.counters.clients == 1)
        client.sendall(b"GET / HTTP/1.1\r\n\r\n")
        assert client.recv(1) == b""
    assert eventually(lambda: server.counters.clients == 0)


def test_a_proxy_without_a_server_closes_the_connection():
    with TcpProxy(("127.0.0.1", free_port())) as proxy, through(proxy) as client:
        assert client.recv(1) == b""


# proxy of the serial line


@contextlib.asynccontextmanager
async def host_on(port):
    host, stop = Host(Session(Instrument(Settings())), port), asyncio.Event()
    await host.connect(stop)
    running = asyncio.create_task(host.run(stop))
    try:
        yield host
    finally:
        stop.set()
        await running


async def until(condition):
    deadline_s = time.monotonic() + TIMEOUT_S
    while not condition():
        assert time.monotonic() < deadline_s, "the condition did not become true in time"
        await asyncio.sleep(0.01)


def state(host):
    return host.instrument.snapshot(PLC, time.monotonic()).state


def test_over_a_noisy_serial_line_the_rig_holds_and_losses_are_counted(tmp_path):
    async def scenario(port):
        with SerialProxy(port) as proxy:
            async with host_on(proxy.port) as host:
                await until(lambda: host.instrument.chain.zero.taken)
                for request in (VENT, HOLD_8):
                    assert host.instrument.write(PLC, request, time.monotonic()) == "none"
                await until(lambda: state(host) == "holding")
                proxy.noise.flipped_bits, proxy.noise.dropped, proxy.noise.doubled = 3e-4, 1e-3, 1e-3
                await until(lambda: host.link.lost_frames > 30 and host.link.decoder.rejected_frames > 30)
                assert state(host) == "holding"
                assert host.link.implausible_frames == 0
                assert 7.8 < host.instrument.measurement.pressure_kpa < 8.2
                for kind in fields(LineNoise()):
                    setattr(proxy.noise, kind.name, kind.default)
                await asyncio.sleep(0.1)
                lost, used = host.link.lost_frames, host.instrument.sample_counter
                await until(lambda: host.instrument.sample_counter > used + 250)
                assert host.link.lost_frames == lost
                assert not host.instrument.faults

    with simulator_at(tmp_path / "rig") as rig:
        rig.ready()
        asyncio.run(scenario(str(tmp_path / "rig")))


def test_a_serial_line_survives_a_board_that_reads_no_bytes_for_a_while():
    def send(data):
        # On a busy machine, the thread of the proxy can pause for longer than the time limit of a write.
        with contextlib.suppress(TimeoutError):
            host.write(data)

    def received():
        send(b"there")
        return b"therethere" in board.read()

    with (
        contextlib.closing(PtyLink()) as board,
        SerialProxy(board.port) as proxy,
        contextlib.closing(SerialPort(proxy.port)) as host,
    ):
        for _ in range(100):
            send(b"x" * 1000)
            time.sleep(0.005)
        assert eventually(received)


def test_an_unplugged_board_is_found_again_by_its_symlink(tmp_path):
    def received_by(far):
        host.write(b"there")
        return b"there" in far.read()

    with (
        contextlib.closing(PtyLink(tmp_path / "rig")) as board,
        SerialProxy(str(tmp_path / "rig")) as proxy,
        contextlib.closing(SerialPort(proxy.port)) as host,
    ):
        assert eventually(lambda: received_by(board))
        for _ in range(2):
            before = board.port
            board.unplug()
            assert host.read() == b""
            host.write(b"lost")
            time.sleep(0.2)
            board.plug()
            assert board.port != before
            assert eventually(lambda: received_by(board))
        board.write(b"back")
        assert eventually(lambda: host.read() == b"back")


def test_a_host_behind_a_proxy_trips_when_the_board_is_unplugged_and_reconnects_when_it_is_back(
    tmp_path,
):
    async def scenario(port, rig):
        with SerialProxy(port) as proxy:
            async with host_on(proxy.port) as host:
                await until(lambda: host.instrument.sample_counter > 50)
                rig.request(fault={"name": "cable_pulled"})
                await until(lambda: state(host) == "tripped")
                rig.request(fault={"name": "cable_pulled", "on": False})
                await until(lambda: not host.instrument.link_lost(time.monotonic()))
                assert host.instrument.snapshot(PLC, time.monotonic()).state == "tripped"

    with simulator_at(tmp_path / "rig") as rig:
        remote = SimulatorClient(rig.ready()["control"])
        asyncio.run(scenario(str(tmp_path / "rig"), remote))


def test_a_cut_serial_line_trips_the_host_and_the_link_recovers_by_itself(tmp_path):
    async def scenario(port):
        with SerialProxy(port) as proxy:
            async with host_on(proxy.port) as host:
                await until(lambda: host.instrument.sample_counter > 50)
                proxy.noise.cut = True
                await until(lambda: state(host) == "tripped")
                proxy.noise.cut = False
                await until(lambda: not host.instrument.link_lost(time.monotonic()))
                assert host.instrument.snapshot(PLC, time.monotonic()).state == "tripped"

    with simulator_at(tmp_path / "rig") as rig:
        rig.ready()
        asyncio.run(scenario(str(tmp_path / "rig")))
