"""Tests of the CAN hub in a separate process, with a raw client and with python-can."""

import contextlib
import signal
import socket
import subprocess
import sys
import time

import can
import pytest

from pneuforce.registers.can.hub import SUSPENDED_S
from pneuforce.registers.can.socketcand import SocketcandDecoder, frame_message
from tests.registers.can.conftest import hub_process, wait_for
from tests.registers.can.raw_client import RawHubClient


@pytest.fixture
def join(hub_port):
    with contextlib.ExitStack() as stack:

        def joined(**options):
            client = RawHubClient(hub_port, **options).join()
            stack.callback(client.link.close)
            return client

        yield joined


def test_a_frame_goes_to_all_other_clients_and_not_back(join):
    first, second, third = join(), join(), join()
    first.send("< send 185 3 a b ff >")
    assert second.frames(1) == third.frames(1) == ["< frame 185 0A0BFF >"]
    second.send("< send 00000123 0  >")
    assert first.frames(1) == third.frames(1) == ["< frame 00000123 >"]


def test_a_frame_has_a_time_stamp_in_microseconds(join):
    first, second = join(), join()
    first.send("< send 185 0 >")
    words = second.read().split()
    assert len(words[3].split(".")[1]) == 6
    assert abs(time.time() - float(words[3])) < 5


def test_messages_may_be_split_and_joined_at_any_byte(join):
    first, second = join(), join()
    text = "".join(f"< send {number:03X} 1 {number % 256:x} >" for number in range(50))
    for at in range(0, len(text), 7):
        first.send(text[at : at + 7])
    assert second.frames(50) == [f"< frame {number:03X} {number % 256:02X} >" for number in range(50)]


GARBAGE = [
    "hello\r\n\r\n>",
    "\x00\xff\xfe>",
    "< >",
    "<<<< send >",
    "< send >",
    "< send 185 >",
    "< send 185 1 >",
    "< send 185 1 100 >",
    "< send 185 1 -1 >",
    "< send 185 9 0 0 0 0 0 0 0 0 0 >",
    "< send 800 0 >",
    "< send 20000000 0 >",
    "< send 18 0 >",
    "< send xyz 0 >",
    "< send 185 x >",
    "< rawmode >",
    "x" * 5000 + ">",
    "< send " * 500 + ">",
]


@pytest.mark.parametrize("garbage", GARBAGE)
def test_garbage_is_discarded_and_the_next_frame_passes(join, garbage):
    first, second = join(), join()
    first.link.sendall(garbage.encode("latin-1"))
    first.send("< send 185 0 >")
    assert second.frames(1) == ["< frame 185 >"]


def test_garbage_is_counted():
    decoder = SocketcandDecoder()
    assert decoder.feed(b"x < a > y > < b >") == [["a"], ["b"]]
    assert decoder.feed(b"<" * 1000) == []
    assert decoder.garbage == 3


@pytest.mark.parametrize("text", [g for g in GARBAGE if g.startswith("< send ")])
def test_a_malformed_send_makes_no_frame(text):
    assert frame_message(text.strip("<> ").split(), 0.0) is None


def test_a_client_without_a_handshake_neither_sends_nor_receives(join, hub_port):
    first = join()
    stranger = RawHubClient(hub_port)
    assert stranger.ask("< open can0 >") == "< ok >"
    first.send("< send 186 0 >")
    assert stranger.ask("< open vcan7 >") == "< error could not open bus >"
    stranger.send("< send 185 0 >")
    join().send("< send 187 0 >")
    assert first.frames(1) == ["< frame 187 >"]
    stranger.link.close()


def test_a_client_receives_all_frames_after_its_last_ok(join):
    first = join()
    first.send("< send 100 0 >")
    late = join()
    first.send("< send 101 0 >")
    assert late.frames(1) == ["< frame 101 >"]


def test_no_frame_arrives_together_with_the_last_ok(join, hub_port):
    first, late = join(), RawHubClient(hub_port)
    assert late.ask("< open can0 >") == "< ok >"
    late.send("< rawmode >")
    while late.link.recv(256, socket.MSG_PEEK) != b"< ok >":
        pass
    first.send("< send 101 0 >")
    time.sleep(0.02)  # a hub without the delay would usually have sent the frame by now
    assert late.link.recv(256) == b"< ok >"
    assert late.frames(1) == ["< frame 101 >"]


def test_python_can_connects_to_a_busy_bus_repeatedly(hub_port, join):
    busy = join()
    for number in range(8):
        busy.send(20 * f"< send 185 1 {number:x} >")
        with can.Bus(
            interface="socketcand", host="127.0.0.1", port=hub_port, channel="can0", tcp_tune=True
        ) as bus:
            busy.send(f"< send 186 1 {number:x} >")
            received = bus.recv(2.0)
            assert received is not None
            assert (received.arbitration_id, received.data[0]) == (0x186, number)


def test_a_client_that_disconnects_within_a_message_does_not_disturb_others(join):
    first, second = join(), join()
    for _ in range(20):
        leaving = join()
        leaving.send("< send 1")
        leaving.link.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\x01\0\0\0\0\0\0\0")
        leaving.link.close()
        first.send("< send 185 0 >")
    assert second.frames(20) == 20 * ["< frame 185 >"]


def test_a_client_that_never_reads_is_disconnected_and_the_others_lose_nothing():
    with hub_process() as (port, _):
        sender, listener, not_reading = (
            RawHubClient(port).join(),
            RawHubClient(port).join(),
            RawHubClient(port, 4096).join(),
        )
        for client in (sender, listener, not_reading):
            client.send("< send 7FF 0 >")  # a client that sends has completed the handshake
        time.sleep(0.1)
        chunk, received = 500 * "< send 185 8 0 1 2 3 4 5 6 7 >", b""
        for _ in range(60):
            sender.send(chunk)
            wanted = received.count(b">") + 500
            while received.count(b">") < wanted:
                received += listener.link.recv(65536)
        assert received.count(b"frame 185 ") == 30_000
        wait_for(lambda: _is_closed(not_reading.link))


def test_a_client_that_sends_requests_and_never_reads_is_disconnected():
    with hub_process() as (port, _), pytest.raises(ConnectionError):
        _request_megabytes(RawHubClient(port, 4096))


def _request_megabytes(client):
    for _ in range(500):
        client.send(5000 * "< open can0 >")


def test_frames_that_arrive_while_the_hub_is_suspended_are_dropped():
    with hub_process() as (port, hub):
        first, second = RawHubClient(port).join(), RawHubClient(port).join()
        for client in (first, second):
            client.send("< send 7FF 0 >")  # a client that sends has completed the handshake
        hub.send_signal(signal.SIGSTOP)
        first.send("< send 100 0 >")
        time.sleep(2 * SUSPENDED_S)
        hub.send_signal(signal.SIGCONT)
        until_s = time.monotonic() + 10
        second.link.settimeout(0.05)
        received = b""
        while b" 101 " not in received and time.monotonic() < until_s:
            first.send("< send 101 0 >")
            with contextlib.suppress(TimeoutError):
                received += second.link.recv(4096)
        assert b" 101 " in received
        assert b" 100 " not in received


def _is_closed(link):
    try:
        while link.recv(65536):
            pass
    except ConnectionError:
        return True
    return True


def test_a_port_in_use_is_reported_in_one_line(hub_port):
    second = subprocess.run(
        [sys.executable, "-m", "pneuforce.registers.can.hub", "--port", str(hub_port)],
        capture_output=True,
        text=True,
    )
    assert second.returncode == 2
    assert second.stderr.count("\n") == 1
    assert f"127.0.0.1:{hub_port}" in second.stderr
    assert "--port" in second.stderr
