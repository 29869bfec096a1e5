"""Tests of the TCP server on real sockets: valid and invalid streams of requests."""

import asyncio
import random
import socket
import struct
import threading
import time

import pytest

from pneuforce.registers.modbus.mbap import MbapDecoder, encode_frame
from pneuforce.registers.modbus.tcp import ModbusTcpOptions, ModbusTcpServer
from tests.registers.modbus.memory_source import MemorySource
from tests.registers.modbus.serving import (
    FORCE,
    FORCE_ANSWER,
    IDENTITY,
    connected,
    eventually,
    read_answer,
    read_until_closed,
    send_request,
    serving,
    still_answers,
)


@pytest.fixture(scope="module")
def server():
    with serving(MemorySource()) as server:
        yield server


@pytest.fixture
def client(server):
    with connected(server) as client:
        yield client


def answers_until_closed(client):
    decoder = MbapDecoder()
    return decoder.feed(read_until_closed(client))


def test_a_read_is_answered_with_its_own_transaction_and_unit(client):
    assert send_request(client, "beef 0000 0006 01 04 0000 0002") == "be ef 00 00 00 07 01 04 04 3f a0 00 00"


@pytest.mark.parametrize("unit", ["01", "00", "ff"])
def test_the_instrument_answers_to_its_unit_to_0_and_to_255(client, unit):
    assert (
        send_request(client, f"0001 0000 0006 {unit} 04 0000 0002")
        == f"00 01 00 00 00 07 {unit} 04 04 3f a0 00 00"
    )


@pytest.mark.parametrize("unit", ["02", "f7", "fe"])
def test_other_unit_ids_are_answered_with_exception_0b(client, unit):
    assert send_request(client, f"0001 0000 0006 {unit} 06 0204 0000") == f"00 01 00 00 00 03 {unit} 86 0b"


def test_three_requests_in_one_segment_get_three_answers_though_one_is_invalid(client):
    client.sendall(encode_frame(1, 1, FORCE) + encode_frame(2, 1, b"\x64") + encode_frame(3, 1, FORCE))
    client.shutdown(socket.SHUT_WR)
    assert answers_until_closed(client) == [(1, 1, FORCE_ANSWER), (2, 1, b"\xe4\x01"), (3, 1, FORCE_ANSWER)]


def test_a_request_byte_by_byte_is_answered_once(client):
    client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    for byte in encode_frame(9, 1, FORCE):
        client.sendall(bytes((byte,)))
        time.sleep(0.001)
    assert read_answer(client) == encode_frame(9, 1, FORCE_ANSWER).hex(" ")
    assert still_answers(client)


def test_hundreds_of_pipelined_requests_in_random_pieces_are_answered_in_order(client):
    stream = b"".join(encode_frame(i, 1, FORCE) for i in range(2000))
    pieces, rng = [], random.Random(5)
    while stream:
        size = rng.randint(1, 700)
        pieces, stream = [*pieces, stream[:size]], stream[size:]
    threading.Thread(target=lambda: [*map(client.sendall, pieces), client.shutdown(socket.SHUT_WR)]).start()
    assert answers_until_closed(client) == [(i, 1, FORCE_ANSWER) for i in range(2000)]


def test_a_half_closed_client_receives_its_answer_and_then_fin(client):
    client.sendall(encode_frame(1, 1, FORCE))
    client.shutdown(socket.SHUT_WR)
    assert read_until_closed(client) == encode_frame(1, 1, FORCE_ANSWER)


@pytest.mark.parametrize(
    "hello",
    [
        b"GET / HTTP/1.1\r\nHost: x\r\n\r\n",
        bytes.fromhex("16030100a5010000a10303"),
        bytes.fromhex("0001 0001 0006 01 04 0000 0002"),
        bytes.fromhex("0001 0000 0000"),
        bytes.fromhex("0001 0000 0001 01"),
        bytes.fromhex("0001 0000 00ff 01 04"),
        encode_frame(1, 1, b"\x83\0\0\0\1"),
        encode_frame(1, 7, b"\x83\0\0\0\1"),  # addressed to another unit
    ],
)
def test_bytes_that_are_not_modbus_close_the_connection(server, client, hello):
    before = server.counters.invalid_frames
    client.sendall(encode_frame(5, 1, FORCE) + hello)
    assert read_until_closed(client) == encode_frame(5, 1, FORCE_ANSWER)
    assert server.counters.invalid_frames == before + 1


def test_no_answer_waits_for_the_acknowledgement_of_another(server, client):
    """A wait for an acknowledgement would take 40 ms or more in each round, even in the shortest one."""
    rounds_s = []
    for _ in range(50):
        start_s = time.monotonic()
        client.sendall(encode_frame(1, 1, FORCE))
        time.sleep(0)
        client.sendall(encode_frame(2, 1, FORCE))
        read_answer(client)
        read_answer(client)
        rounds_s.append(time.monotonic() - start_s)
    assert min(rounds_s) < 0.03


def test_the_counters_count_requests_exceptions_and_clients():
    with serving(MemorySource()) as server, connected(server) as client:
        send_request(client, "0001 0000 0006 01 04 0000 0002")
        send_request(client, "0001 0000 0006 01 04 0000 0000")
        send_request(client, "0001 0000 0006 07 04 0000 0002")
        counters = server.counters
        assert (counters.clients, counters.connections, counters.requests, counters.exceptions) == (
            1,
            1,
            3,
            2,
        )
        client.close()
        assert eventually(lambda: counters.clients == 0)


def test_an_internal_error_in_one_request_keeps_the_connection_open():
    class FailingSource(MemorySource):
        def write(self, peer, values, now_s):
            raise ZeroDivisionError

    with serving(FailingSource()) as server, connected(server) as client:
        assert send_request(client, "0001 0000 0006 01 06 0204 0001") == "00 01 00 00 00 03 01 86 04"
        assert still_answers(client)


def test_a_peer_is_identified_by_its_address_and_not_by_its_port():
    peers = set()
    source = MemorySource(reject=lambda peer, values: peers.add(peer) or "none")
    with serving(source) as server:
        for _ in range(2):
            with connected(server) as client:
                send_request(client, "0001 0000 0006 01 06 0204 0001")
    assert peers == {("modbus_tcp", "127.0.0.1")}


def test_force_and_counter_of_one_answer_belong_to_the_same_sample():
    class ChangingSource(MemorySource):
        def snapshot(self, peer, now_s):
            self.values["force_n"] = float(self.values["sample_counter"] + 1)
            return super().snapshot(peer, now_s)

    with serving(ChangingSource()) as server, connected(server) as client:
        for _ in range(200):
            words = bytes.fromhex(send_request(client, "0001 0000 0006 01 04 0000 0018"))[9:]
            assert struct.unpack_from(">f", words, 0)[0] == struct.unpack_from(">I", words, 44)[0]


def test_a_port_in_use_raises_oserror():
    async def second(port):
        await ModbusTcpServer(MemorySource(), ModbusTcpOptions(port=port), IDENTITY).start()

    with serving(MemorySource()) as server, pytest.raises(OSError, match="in use"):
        asyncio.run(second(server.port))


def test_closing_the_server_closes_its_connections():
    with serving(MemorySource()) as server:
        client = connected(server)
        assert still_answers(client)
        port = server.port
    assert read_until_closed(client) == b""
    client.close()
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", port), timeout=1)
