"""The hub as a process, spoken to byte by byte and by python-can."""

import contextlib
import signal
import socket
import subprocess
import sys
import time

import can
import pytest

from registers.can.hub import STOOD_S
from registers.can.socketcand import Decoder, frame_of_send
from tests.registers.can.conftest import hub_process, wait_for
from tests.registers.can.raw_client import Client


@pytest.fixture
def join(hub_port):
    with contextlib.ExitStack() as stack:

        def joined(**options):
            client = Client(hub_port, **options).join()
            stack.callback(client.link.close)
            return client

        yield joined


def test_a_frame_goes_to_all_others_and_not_back(join):
    first, second, third = join(), join(), join()
    first.send("< send 185 3 a b ff >")
    assert second.frames(1) == third.frames(1) == ["< frame 185 0A0BFF >"]
    second.send("< send 00000123 0  >")
    assert first.frames(1) == third.frames(1) == ["< frame 00000123 >"]


def test_a_frame_carries_the_wall_clock_in_microseconds(join):
    first, second = join(), join()
    first.send("< send 185 0 >")
    words = second.read().split()
    assert len(words[3].split(".")[1]) == 6
    assert abs(time.time() - float(words[3])) < 5


def test_messages_may_be_cut_and_joined_anywhere(join):
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
def test_garbage_is_swallowed_and_the_next_frame_passes(join, garbage):
    first, second = join(), join()
    first.link.sendall(garbage.encode("latin-1"))
    first.send("< send 185 0 >")
    assert second.frames(1) == ["< frame 185 >"]


def test_garbage_is_counted():
    decoder = Decoder()
    assert decoder.feed(b"x < a > y > < b >") == [["a"], ["b"]]
    assert decoder.feed(b"<" * 1000) == []
    assert decoder.garbage == 3


@pytest.mark.parametrize("text", [g for g in GARBAGE if g.startswith("< send ")])
def test_a_malformed_send_makes_no_frame(text):
    assert frame_of_send(text.strip("<> ").split(), 0.0) is None


def test_a_client_without_a_handshake_neither_hears_nor_speaks(join, hub_port):
    first = join()
    stranger = Client(hub_port)
    stranger.send("< send 185 0 >< rawmode >")
    first.send("< send 186 0 >")
    assert stranger.ask("< open vcan7 >") == "< error could not open bus >"
    join().send("< send 187 0 >")
    assert first.frames(1) == ["< frame 187 >"]
    stranger.link.close()


def test_a_late_joiner_hears_what_is_sent_from_its_last_ok_on(join):
    first = join()
    first.send("< send 100 0 >")
    late = join()
    first.send("< send 101 0 >")
    assert late.frames(1) == ["< frame 101 >"]


def test_no_frame_comes_glued_to_the_last_ok(join, hub_port):
    first, late = join(), Client(hub_port)
    assert late.ask("< open can0 >") == "< ok >"
    late.send("< rawmode >")
    while late.link.recv(256, socket.MSG_PEEK) != b"< ok >":
        pass
    first.send("< send 101 0 >")
    time.sleep(0.02)  # a hub that did not wait would have sent it by now, mostly
    assert late.link.recv(256) == b"< ok >"
    assert late.frames(1) == ["< frame 101 >"]


def test_python_can_joins_a_busy_bus_again_and_again(hub_port, join):
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


def test_a_client_that_goes_in_the_middle_harms_nobody(join):
    first, second = join(), join()
    for _ in range(20):
        leaving = join()
        leaving.send("< send 1")
        leaving.link.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\x01\0\0\0\0\0\0\0")
        leaving.link.close()
        first.send("< send 185 0 >")
    assert second.frames(20) == 20 * ["< frame 185 >"]


def test_a_client_that_never_reads_is_given_up_and_the_others_miss_nothing():
    with hub_process() as (port, _):
        speaker, listener, deaf = Client(port).join(), Client(port).join(), Client(port, 4096).join()
        for client in (speaker, listener, deaf):
            client.send("< send 7FF 0 >")  # who speaks has joined
        time.sleep(0.1)
        chunk, heard = 500 * "< send 185 8 0 1 2 3 4 5 6 7 >", b""
        for _ in range(60):
            speaker.send(chunk)
            wanted = heard.count(b">") + 500
            while heard.count(b">") < wanted:
                heard += listener.link.recv(65536)
        assert heard.count(b"frame 185 ") == 30_000
        wait_for(lambda: _is_closed(deaf.link))


def test_a_client_that_asks_for_ever_and_never_reads_is_given_up():
    with hub_process() as (port, _), pytest.raises(ConnectionError):
        _ask_for_megabytes(Client(port, 4096))


def _ask_for_megabytes(client):
    for _ in range(500):
        client.send(5000 * "< open can0 >")


def test_what_came_while_the_hub_stood_still_is_dropped_and_the_next_frame_passes():
    with hub_process() as (port, hub):
        first, second = Client(port).join(), Client(port).join()
        for client in (first, second):
            client.send("< send 7FF 0 >")  # who speaks has joined
        hub.send_signal(signal.SIGSTOP)
        first.send("< send 100 0 >")
        time.sleep(2 * STOOD_S)
        hub.send_signal(signal.SIGCONT)
        until_s = time.monotonic() + 10
        second.link.settimeout(0.05)
        heard = b""
        while b" 101 " not in heard and time.monotonic() < until_s:
            first.send("< send 101 0 >")
            with contextlib.suppress(TimeoutError):
                heard += second.link.recv(4096)
        assert b" 101 " in heard
        assert b" 100 " not in heard


def _is_closed(link):
    try:
        while link.recv(65536):
            pass
    except ConnectionError:
        return True
    return True


def test_a_port_in_use_is_named_in_one_sentence(hub_port):
    second = subprocess.run(
        [sys.executable, "-m", "registers.can.hub", "--port", str(hub_port)], capture_output=True, text=True
    )
    assert second.returncode == 2
    assert second.stderr.count("\n") == 1
    assert f"cannot listen on 127.0.0.1:{hub_port}: it is in use; --port takes another" in second.stderr
