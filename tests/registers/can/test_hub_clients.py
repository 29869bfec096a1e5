"""Many clients at the hub: who gets in, who is sent away, what stays behind."""

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

from registers.can.bus import Bus, BusAt
from registers.can.hub import MOST_CLIENTS, Hub
from registers.can.socketcand import Decoder, frame_of_send
from tests.registers.can.buses import heard, message, opened, peer_on
from tests.registers.can.conftest import hub_process, wait_for
from tests.registers.can.raw_client import Client

BURST = 10_000


def test_all_who_have_room_hear_all_others_and_the_next_one_is_told_why_not():
    with hub_process() as (port, _), contextlib.ExitStack() as stack:
        clients = [Client(port).join() for _ in range(MOST_CLIENTS)]
        for client in clients:
            stack.callback(client.link.close)
        with pytest.raises(OSError, match=r"cannot be opened: .*too many clients"):
            Bus(BusAt(interface="socketcand", port=port))
        for number, client in enumerate(clients):
            client.send(f"< send {number:03X} 0 >")
        for own, client in enumerate(clients):
            expected = {f"< frame {number:03X} >" for number in range(MOST_CLIENTS) if number != own}
            assert set(client.frames(MOST_CLIENTS - 1)) == expected


def test_room_that_is_made_is_given_to_the_next():
    with hub_process() as (port, _), contextlib.ExitStack() as stack:
        clients = [stack.enter_context(contextlib.closing(Client(port).link)) for _ in range(MOST_CLIENTS)]
        clients[0].close()

        def gets_in():
            with contextlib.suppress(AssertionError, ConnectionError):
                return Client(port).join()

        wait_for(gets_in)


@pytest.mark.parametrize("words", [b"", b"< open can0 >", b"< send 185 0 >"])
def test_who_does_not_join_in_time_is_closed_and_who_has_joined_may_be_silent(monkeypatch, words):
    monkeypatch.setattr("registers.can.hub_client.HANDSHAKE_S", 0.1)

    async def play():
        hub = Hub()
        port = await hub.start(0)
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        member, voice = await asyncio.open_connection("127.0.0.1", port)
        voice.write(b"< open can0 >< rawmode >")
        writer.write(words)
        async with asyncio.timeout(15):
            await reader.read()
            said = await member.readuntil(b"< ok >< ok >")
        await asyncio.sleep(0.3)
        assert (hub.counters.given_up, len(hub.members), member.at_eof()) == (1, 1, False)
        hub.close()
        for stream in (writer, voice):
            stream.close()
        return said

    assert asyncio.run(play()) == b"< hi >< ok >< ok >"


def test_who_has_left_is_given_no_more_frames():
    async def play():
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

    asyncio.run(play())


def test_a_thousand_clients_leave_nothing_behind():
    with hub_process() as (port, hub):
        listener = Client(port).join()

        def open_files():
            return len(list(Path(f"/proc/{hub.pid}/fd").iterdir()))

        before, before_kb = open_files(), resident_kb(hub.pid)
        for number in range(1000):
            with contextlib.closing(Client(port).join().link) as link:
                link.sendall(f"< send {number % 0x800:03X} 1 0 >".encode())
                if number % 2:
                    link.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\x01\0\0\0\0\0\0\0")
        wait_for(lambda: open_files() == before)
        assert resident_kb(hub.pid) - before_kb < 4096
        for client in (Client(port).join(), Client(port).join()):
            client.send("< send 7FF 0 >")
        while listener.read().split()[2] != "7FF":
            pass


def resident_kb(pid):
    return int(re.search(r"VmRSS:\s+(\d+)", Path(f"/proc/{pid}/status").read_text())[1])


def test_ten_thousand_frames_at_once_pass_between_two_that_read(hub_port):
    at = BusAt(interface="socketcand", port=hub_port)
    got = []
    with opened(at, got.append), peer_on(at) as speaker, peer_on(at) as reader:
        messages = []
        reading = threading.Thread(target=lambda: messages.extend(heard(reader, BURST, 60)))
        reading.start()
        for number in range(BURST):
            speaker.send(message(number))
        reading.join()
        wait_for(lambda: len(got) == BURST, 60)
    for numbers in ([m.data for m in messages], [frame.data for frame in got]):
        assert [int.from_bytes(data, "little") for data in numbers] == list(range(BURST))


@given(st.lists(st.binary(max_size=300)))
def test_no_bytes_upset_the_decoder_and_what_it_passes_on_python_can_reads(chunks):
    decoder = Decoder()
    for words in (words for chunk in chunks for words in decoder.feed(chunk)):
        frame = frame_of_send(words, 0.0)
        assert frame is None or convert_ascii_message_to_can_message(frame.decode()) is not None


WORDS = st.one_of(
    st.sampled_from(["send", "185", "00000185", "0", "1", "8", "ff", "<", "open", "1_0", "+1", "0x1", "-0"]),
    st.text(alphabet="0123456789abcdefABCDEFx_ +-", max_size=9),
)


@given(st.lists(WORDS, max_size=12))
def test_what_looks_nearly_like_a_send_is_a_frame_or_nothing(words):
    frame = frame_of_send(words, 0.0)
    if frame is not None:
        passed_on = convert_ascii_message_to_can_message(frame.decode())
        assert passed_on.arbitration_id == int(words[1], 16)
        assert passed_on.is_extended_id == (len(words[1]) == 8)
        assert list(passed_on.data) == [int(word, 16) for word in words[3:]]
