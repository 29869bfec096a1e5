"""The real instrument behind a bad line: its Modbus server, and its host on a simulated rig."""

import asyncio
import contextlib
import socket
import time
from dataclasses import fields

import pytest

from instrument.core import Instrument
from instrument.coupling import Coupling
from instrument.host import Host
from instrument.rig.port import SerialPort
from instrument.settings import Settings
from registers.modbus.mbap import frame
from sim.cable import Cable
from sim.line_noise import Noise
from sim.proxy import SerialProxy, TcpProxy
from sim.remote import Remote
from tests.instrument.driving import HOLD_8, PLC, VENT
from tests.registers.modbus.memory import MemorySource
from tests.registers.modbus.serving import (
    FORCE,
    FORCE_ANSWER,
    connected,
    eventually,
    exactly,
    received,
    serving,
    still_answers,
)
from teststand.children import Child

PATIENCE_S = 20.0


@pytest.fixture(scope="module")
def server():
    with serving(MemorySource()) as server:
        yield server


@pytest.fixture
def proxy(server):
    with TcpProxy(("127.0.0.1", server.port)) as proxy:
        yield proxy


def through(proxy):
    return socket.create_connection(("127.0.0.1", proxy.port), timeout=PATIENCE_S)


def test_a_request_in_late_pieces_is_answered_once_and_rightly(proxy):
    proxy.noise.most_bytes, proxy.noise.delay_s = 1, 0.02
    with through(proxy) as client:
        begun_s = time.monotonic()
        for number in range(3):
            client.sendall(frame(number, 1, FORCE))
            assert received(client) == frame(number, 1, FORCE_ANSWER).hex(" ")
        assert time.monotonic() - begun_s >= 3 * 2 * 0.02


def test_what_a_stall_held_back_arrives_in_order_when_it_is_over(proxy):
    with through(proxy) as client:
        proxy.noise.stalled = True
        stream = b"".join(frame(number, 1, FORCE) for number in range(50))
        client.sendall(stream)
        client.settimeout(0.1)
        with pytest.raises(TimeoutError):
            client.recv(1)
        client.settimeout(PATIENCE_S)
        proxy.noise.stalled = False
        answers = b"".join(frame(number, 1, FORCE_ANSWER) for number in range(50))
        assert exactly(client, len(answers)) == answers


def test_corrupt_requests_never_crash_the_server_and_leave_no_connection_behind(server, proxy):
    proxy.noise.flipped_bits, proxy.noise.dropped, proxy.noise.inserted = 0.01, 0.01, 0.01
    for _ in range(100):
        with through(proxy) as client, contextlib.suppress(OSError):
            client.settimeout(0.02)
            client.sendall(b"".join(frame(number, 1, FORCE) for number in range(5)))
            client.recv(4096)
    assert server.counters.refused_frames > 10
    with connected(server) as clean:
        assert still_answers(clean)
    assert eventually(lambda: server.counters.clients == 0)


def test_a_connection_ends_for_both_sides_when_one_of_them_ends_it(server, proxy):
    with through(proxy) as client:
        client.sendall(frame(1, 1, FORCE))
        received(client)
        assert eventually(lambda: server.counters.clients == 1)
        client.sendall(b"GET / HTTP/1.1\r\n\r\n")
        assert client.recv(1) == b""
    assert eventually(lambda: server.counters.clients == 0)


def test_a_proxy_of_nobody_closes_the_connection():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        nobody = listener.getsockname()
    with TcpProxy(nobody) as proxy, through(proxy) as client:
        assert client.recv(1) == b""


# the serial line


@contextlib.asynccontextmanager
async def host_on(port):
    host, stop = Host(Coupling(Instrument(Settings())), port), asyncio.Event()
    await host.connect(stop)
    running = asyncio.create_task(host.run(stop))
    try:
        yield host
    finally:
        stop.set()
        await running


async def until(condition):
    deadline_s = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline_s, "what was waited for did not come"
        await asyncio.sleep(0.01)


def state(host):
    return host.instrument.snapshot(PLC, time.monotonic()).state


def test_through_a_noisy_serial_line_the_rig_holds_and_losses_are_counted_until_it_is_clean_again(tmp_path):
    async def story(port):
        with SerialProxy(port) as proxy:
            async with host_on(proxy.port) as host:
                await until(lambda: host.instrument.chain.zero.taken)
                for request in (VENT, HOLD_8):
                    assert host.instrument.write(PLC, request, time.monotonic()) == "none"
                await until(lambda: state(host) == "holding")
                proxy.noise.flipped_bits, proxy.noise.dropped, proxy.noise.doubled = 3e-4, 1e-3, 1e-3
                await until(lambda: host.link.lost_frames > 30 and host.link.decoder.refused > 30)
                assert state(host) == "holding"
                assert host.link.implausible_frames == 0
                assert 7.8 < host.instrument.measurement.pressure_kpa < 8.2
                for kind in fields(Noise()):
                    setattr(proxy.noise, kind.name, kind.default)
                await asyncio.sleep(0.1)
                lost, used = host.link.lost_frames, host.instrument.sample_counter
                await until(lambda: host.instrument.sample_counter > used + 250)
                assert host.link.lost_frames == lost
                assert not host.instrument.faults

    with Child("simulator", ["instrument", "sim", "--link", str(tmp_path / "rig"), "--no-hand"]) as rig:
        rig.ready()
        asyncio.run(story(str(tmp_path / "rig")))


def test_a_serial_line_outlives_a_board_that_takes_no_bytes_for_a_while():
    def heard():
        host.write(b"there")
        return b"therethere" in board.read()

    with (
        contextlib.closing(Cable()) as board,
        SerialProxy(board.port) as proxy,
        contextlib.closing(SerialPort(proxy.port)) as host,
    ):
        for _ in range(100):
            host.write(b"x" * 1000)
            time.sleep(0.005)
        assert eventually(heard)


def test_a_board_whose_cable_was_pulled_is_found_again_where_its_link_points_now(tmp_path):
    def heard(far):
        host.write(b"there")
        return b"there" in far.read()

    with (
        contextlib.closing(Cable(tmp_path / "rig")) as board,
        SerialProxy(str(tmp_path / "rig")) as proxy,
        contextlib.closing(SerialPort(proxy.port)) as host,
    ):
        assert eventually(lambda: heard(board))
        for _ in range(2):
            before = board.port
            board.pull()
            assert host.read() == b""
            host.write(b"lost")
            time.sleep(0.2)
            board.plug()
            assert board.port != before
            assert eventually(lambda: heard(board))
        board.write(b"back")
        assert eventually(lambda: host.read() == b"back")


def test_a_host_behind_a_proxy_trips_when_the_boards_cable_is_pulled_and_hears_it_again_when_it_is_back(
    tmp_path,
):
    async def story(port, rig):
        with SerialProxy(port) as proxy:
            async with host_on(proxy.port) as host:
                await until(lambda: host.instrument.sample_counter > 50)
                rig.order(fault={"name": "cable_pulled"})
                await until(lambda: state(host) == "tripped")
                rig.order(fault={"name": "cable_pulled", "on": False})
                await until(lambda: not host.instrument.link_lost(time.monotonic()))
                assert host.instrument.snapshot(PLC, time.monotonic()).state == "tripped"

    with Child("simulator", ["instrument", "sim", "--link", str(tmp_path / "rig"), "--no-hand"]) as rig:
        remote = Remote(rig.ready()["control"])
        asyncio.run(story(str(tmp_path / "rig"), remote))


def test_a_serial_line_that_is_cut_trips_the_host_and_the_link_comes_back_by_itself(tmp_path):
    async def story(port):
        with SerialProxy(port) as proxy:
            async with host_on(proxy.port) as host:
                await until(lambda: host.instrument.sample_counter > 50)
                proxy.noise.cut = True
                await until(lambda: state(host) == "tripped")
                proxy.noise.cut = False
                await until(lambda: not host.instrument.link_lost(time.monotonic()))
                assert host.instrument.snapshot(PLC, time.monotonic()).state == "tripped"

    with Child("simulator", ["instrument", "sim", "--link", str(tmp_path / "rig"), "--no-hand"]) as rig:
        rig.ready()
        asyncio.run(story(str(tmp_path / "rig")))
