"""Tests of the hub with many clients: connection limit, handshake timeout, and release of resources."""

import asyncio
import contextlib
import re
import socket
import threading
from pathlib import Path

import pytest
from can.interfaces.socketcand.socketcand import convert_ascii_message_to_can_message
from hypothesis import given
from hypothesis import strategies as st

from pneuforce.registers.can.bus import CanAddress, CanBus
from pneuforce.registers.can.hub import MAX_CLIENTS, Hub
from pneuforce.registers.can.socketcand import SocketcandDecoder, frame_message
from tests.registers.can.bus_helpers import message, opened_connection, python_can_client, received_messages
from tests.registers.can.conftest import hub_process, wait_for
from tests.registers.can.raw_client import RawHubClient

BURST = 10_000


def test_the_maximum_number_of_clients_is_served_and_a_further_one_is_rejected():
    with hub_process() as (port, _), contextlib.ExitStack() as stack:
        clients = [RawHubClient(port).join() for _ in range(MAX_CLIENTS)]
        for client in clients:
            stack.callback(client.link.close)
        with pytest.raises(OSError, match="too many clients"):
            CanBus(CanAddress(interface="socketcand", port=port))
        for number, client in enumerate(clients):
            client.send(f"< send {number:03X} 0 >")
        for own_number, client in enumerate(clients):
            expected = {f"< frame {number:03X} >" for number in range(MAX_CLIENTS) if number != own_number}
            assert set(client.frames(MAX_CLIENTS - 1)) == expected


def test_after_a_disconnection_the_next_client_is_accepted():
    with hub_process() as (port, _), contextlib.ExitStack() as stack:
        clients = [
            stack.enter_context(contextlib.closing(RawHubClient(port).link)) for _ in range(MAX_CLIENTS)
        ]
        clients[0].close()

        def connects():
            with contextlib.suppress(AssertionError, ConnectionError):
                return RawHubClient(port).join()

        wait_for(connects)


@pytest.mark.parametrize("words", [b"", b"< open can0 >", b"< send 185 0 >"])
def test_a_client_without_a_handshake_is_disconnected_and_a_silent_member_is_not(monkeypatch, words):
    monkeypatch.setattr("pneuforce.registers.can.hub_client.HANDSHAKE_TIMEOUT_S", 0.1)

    async def run():
        hub = Hub()
        port = await hub.start(0)
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        member_reader, member_writer = await asyncio.open_connection("127.0.0.1", port)
        member_writer.write(b"< open can0 >< rawmode >")
        writer.write(words)
        async with asyncio.timeout(15):
            await reader.read()
            handshake = await member_reader.readuntil(b"< ok >< ok >")
        await asyncio.sleep(0.3)
        assert (hub.counters.disconnected, len(hub.members), member_reader.at_eof()) == (1, 1, False)
        hub.close()
        for stream in (writer, member_writer):
            stream.close()
        return handshake

    assert asyncio.run(run()) == b"< hi >< ok >< ok >"


def test_a_disconnected_client_is_no_longer_a_member():
    async def run():
        hub = Hub()
        port = await hub.start(0)
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        writer.write(b"< open can0 >< rawmode >")
        async with asyncio.timeout(15):
            await reader.readuntil(b"< ok >< ok >")
            assert len(hub.members) == 1
            writer.close()
            while hub.members:
                await asyncio.sleep(0.005)
        hub.close()

    asyncio.run(run())


def test_a_thousand_disconnected_clients_leave_no_open_files_and_little_memory():
    with hub_process() as (port, hub):
        listener = RawHubClient(port).join()

        def open_files():
            return len(list(Path(f"/proc/{hub.pid}/fd").iterdir()))

        before, before_kb = open_files(), resident_kb(hub.pid)
        for number in range(1000):
            with contextlib.closing(RawHubClient(port).join().link) as link:
                link.sendall(f"< send {number % 0x800:03X} 1 0 >".encode())
                if number % 2:
                    link.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\x01\0\0\0\0\0\0\0")
        wait_for(lambda: open_files() == before)
        assert resident_kb(hub.pid) - before_kb < 4096
        for client in (RawHubClient(port).join(), RawHubClient(port).join()):
            client.send("< send 7FF 0 >")
        while listener.read().split()[2] != "7FF":
            pass


def resident_kb(pid):
    return int(re.search(r"VmRSS:\s+(\d+)", Path(f"/proc/{pid}/status").read_text())[1])


def test_ten_thousand_frames_at_once_arrive_at_two_readers(hub_port):
    at = CanAddress(interface="socketcand", port=hub_port)
    got = []
    with opened_connection(at, got.append), python_can_client(at) as sender, python_can_client(at) as reader:
        messages = []
        reading = threading.Thread(target=lambda: messages.extend(received_messages(reader, BURST, 60)))
        reading.start()
        for number in range(BURST):
            sender.send(message(number))
        reading.join()
        wait_for(lambda: len(got) == BURST, 60)
    for numbers in ([m.data for m in messages], [frame.data for frame in got]):
        assert [int.from_bytes(data, "little") for data in numbers] == list(range(BURST))


@given(st.lists(st.binary(max_size=300)))
def test_any_bytes_are_decoded_and_python_can_reads_each_forwarded_frame(chunks):
    decoder = SocketcandDecoder()
    for words in (words for chunk in chunks for words in decoder.feed(chunk)):
        frame = frame_message(words, 0.0)
        assert frame is None or convert_ascii_message_to_can_message(frame.decode()) is not None


WORDS = st.one_of(
    st.sampled_from(["send", "185", "00000185", "0", "1", "8", "ff", "<", "open", "1_0", "+1", "0x1", "-0"]),
    st.text(alphabet="0123456789abcdefABCDEFx_ +-", max_size=9),
)


@given(st.lists(WORDS, max_size=12))
def test_a_message_similar_to_send_is_forwarded_correctly_or_not_at_all(words):
    frame = frame_message(words, 0.0)
    if frame is not None:
        forwarded = convert_ascii_message_to_can_message(frame.decode())
        assert forwarded.arbitration_id == int(words[1], 16)
        assert forwarded.is_extended_id == (len(words[1]) == 8)
        assert list(forwarded.data) == [int(word, 16) for word in words[3:]]
