"""Tests of the TCP server on real sockets: time-outs, limits, and clients that misbehave."""

import asyncio
import contextlib
import itertools
import os
import socket
import struct
import threading
import time

import pytest

from pneuforce.registers.modbus.mbap import encode_frame
from pneuforce.registers.modbus.tcp import ModbusTcpOptions, ModbusTcpServer
from tests.registers.modbus.memory_source import MemorySource
from tests.registers.modbus.serving import (
    FORCE,
    FORCE_ANSWER,
    IDENTITY,
    connected,
    eventually,
    read_answer,
    read_exactly,
    read_until_closed,
    send_request,
    serving,
    still_answers,
)


def test_an_incomplete_frame_closes_its_connection_though_it_grows_slowly():
    with (
        serving(MemorySource(), frame_timeout_s=0.3, idle_timeout_s=60) as server,
        connected(server) as client,
        connected(server) as other,
    ):
        start_s, data, sent = time.monotonic(), encode_frame(1, 1, bytes(200)), 0
        with contextlib.suppress(OSError):
            for sent in range(len(data) - 1):  # the last byte would complete the frame
                client.sendall(data[sent : sent + 1])
                time.sleep(0.02)
        assert sent < 200, "the connection was not closed"
        assert time.monotonic() - start_s >= 0.3
        assert still_answers(other)
        assert server.counters.timeouts == 1


def test_requests_that_overlap_segments_do_not_time_out():
    with serving(MemorySource(), frame_timeout_s=0.2) as server, connected(server) as client:
        data = encode_frame(1, 1, FORCE)
        client.sendall(data[:5])
        for _ in range(10):
            time.sleep(0.06)
            client.sendall(data[5:] + data[:5])
            assert read_answer(client) == encode_frame(1, 1, FORCE_ANSWER).hex(" ")


def test_an_idle_connection_is_closed_and_a_busy_one_is_not():
    with (
        serving(MemorySource(), idle_timeout_s=0.3) as server,
        connected(server) as idle,
        connected(server) as busy,
    ):
        idle.setblocking(False)
        assert eventually(lambda: still_answers(busy) and closed(idle))
        assert still_answers(busy)


def closed(client):
    try:
        return client.recv(1) == b""
    except BlockingIOError:
        return False


FLOOD_ADDRESS, PLC = "127.0.0.1", "127.0.0.2"


def test_a_flood_from_one_address_evicts_only_itself_and_another_peer_can_vent():
    source = MemorySource()
    with serving(source, max_connections=4) as server, contextlib.ExitStack() as stack:
        plc = stack.enter_context(connected(server, PLC))
        assert still_answers(plc)
        flood = [stack.enter_context(connected(server)) for _ in range(20)]
        assert all(read_until_closed(client) == b"" for client in flood[:-3])
        assert all(map(still_answers, flood[-3:]))
        source.values["mode"] = "hold"
        new_client = stack.enter_context(connected(server, PLC))
        assert (
            send_request(new_client, "0001 0000 0006 01 06 0204 0000")
            == "00 01 00 00 00 06 01 06 02 04 00 00"
        )
        assert source.values["mode"] == "vent"
        assert still_answers(plc)
        assert (server.counters.evicted, server.counters.clients) == (18, 4)


def test_the_longest_silent_connection_of_the_address_with_most_connections_is_evicted():
    with serving(MemorySource(), max_connections=3) as server, contextlib.ExitStack() as stack:
        oldest, silent, busy = (stack.enter_context(connected(server)) for _ in range(3))
        for client in (oldest, silent, busy, oldest):
            assert still_answers(client)
        new_client = stack.enter_context(connected(server, PLC))
        assert still_answers(new_client)
        assert read_until_closed(silent) == b""
        assert all(map(still_answers, (oldest, busy, new_client)))


def test_200_connections_from_the_address_of_a_plc_do_not_evict_the_plc():
    with serving(MemorySource()) as server, contextlib.ExitStack() as stack:
        plc = stack.enter_context(connected(server, PLC))
        for n in range(200):
            if n % 20 == 0:
                assert still_answers(plc)
                time.sleep(0.05)
            stack.enter_context(connected(server, PLC))
        assert eventually(lambda: server.counters.evicted == 201 - server.options.max_connections)
        assert still_answers(plc)


def test_polling_clients_from_70_addresses_do_not_evict_the_two_connections_of_a_plc():
    with serving(MemorySource()) as server, contextlib.ExitStack() as stack:
        plc = [stack.enter_context(connected(server, PLC)) for _ in range(2)]
        crowd = []
        for n in range(70):
            assert all(map(still_answers, plc))
            crowd.append(stack.enter_context(connected(server, f"127.0.1.{n + 1}")))
            for _ in range(3):
                crowd = [client for client in crowd if answers_or_is_closed(client)]
        assert server.counters.evicted == 72 - server.options.max_connections == 70 - len(crowd)
        assert all(map(still_answers, plc))


def answers_or_is_closed(client):
    with contextlib.suppress(ConnectionError):
        return still_answers(client)


def test_the_new_connection_counts_for_its_address_and_is_never_evicted():
    with serving(MemorySource(), max_connections=4) as server, contextlib.ExitStack() as stack:
        plc = [stack.enter_context(connected(server, PLC)) for _ in range(2)]
        flood = [stack.enter_context(connected(server, FLOOD_ADDRESS)) for _ in range(2)]
        for client in plc + flood:  # the connections of the PLC are silent for the longest time
            assert still_answers(client)
        new_client = stack.enter_context(connected(server, FLOOD_ADDRESS))
        assert still_answers(new_client)
        assert read_until_closed(flood[0]) == b""
        assert all(map(still_answers, (*plc, flood[1])))


def test_a_client_that_never_reads_is_closed_and_others_are_served():
    with (
        serving(MemorySource(), frame_timeout_s=0.5) as server,
        connected(server) as not_reading,
        connected(server) as other,
    ):
        not_reading.setblocking(False)
        requests = b"".join(encode_frame(i, 1, bytes.fromhex("04 0000 007d")) for i in range(300))
        while server.counters.timeouts == 0:
            try:
                not_reading.send(requests)
            except BlockingIOError:
                time.sleep(0.005)
            except OSError:
                break
            assert still_answers(other)
        assert eventually(lambda: server.counters.clients == 1)
        assert server.counters.timeouts == 1
        assert still_answers(other)


@pytest.mark.parametrize("writes", [0, 1, 2])  # with two or three of them, reading stops within a frame
def test_a_time_out_is_counted_once_although_reading_stops_within_a_frame(writes):
    ticks = itertools.count()

    async def stop_reading_then_time_out():
        options = ModbusTcpOptions(port=0, frame_timeout_s=1000, idle_timeout_s=2000)
        server = ModbusTcpServer(MemorySource(), options, IDENTITY, lambda: next(ticks) * 0.001)
        await server.start()
        with connected(server) as client:
            await send_until_not_read(client, server, MODE_WRITE * writes + LONG_READ * 60000)
            [connection] = server.connections
            now_s = server.clock() + 999
            while server.connections:
                now_s += 0.0002
                connection.close_if_timed_out(now_s)
                await asyncio.sleep(0)
        server.close()
        return server.counters.timeouts

    assert asyncio.run(stop_reading_then_time_out()) == 1


LONG_READ = encode_frame(1, 1, bytes.fromhex("04 0000 007d"))
MODE_WRITE = encode_frame(1, 1, bytes.fromhex("10 0000 0001 02 0000"))


async def send_until_not_read(client, server, data):
    """Send until the server has answered nothing in 1000 passes of its event loop."""
    client.setblocking(False)
    passes = requests = 0
    while passes < 1000:
        with contextlib.suppress(BlockingIOError):
            data = data[client.send(data) :]
        await asyncio.sleep(0)
        passes = passes + 1 if requests == server.counters.requests else 0
        requests = server.counters.requests


def test_requests_of_a_client_that_does_not_read_are_paused_until_it_reads():
    with serving(MemorySource(), frame_timeout_s=1.0) as server, connected(server) as client:
        count, long_read = 60000, bytes.fromhex("04 0000 007d")
        stream = b"".join(encode_frame(i & 0xFFFF, 1, long_read) for i in range(count))
        sender = threading.Thread(target=client.sendall, args=(stream,))
        sender.start()
        assert eventually(lambda: 0 < server.counters.requests == requests_a_moment_later(server))
        assert server.counters.requests < count
        stopped_s = time.monotonic()
        size = len(encode_frame(0, 1, bytes(2 + 250)))
        answers = read_exactly(client, count * size)
        sender.join()
        assert [answers[i : i + 2] for i in range(0, len(answers), size)] == [
            struct.pack(">H", i & 0xFFFF) for i in range(count)
        ]
        time.sleep(max(0.0, stopped_s + 1.6 - time.monotonic()))
        assert still_answers(client), "closed although the client has read all answers"


def requests_a_moment_later(server):
    time.sleep(0.1)
    return server.counters.requests


def test_a_thousand_connections_with_resets_leave_no_open_files():
    with serving(MemorySource()) as server:
        before = len(os.listdir("/proc/self/fd"))
        for i in range(1000):
            client = connected(server)
            client.sendall(encode_frame(1, 1, FORCE)[: i % 12])
            if i % 2:  # RST instead of FIN
                client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            client.close()
        counters = server.counters
        assert eventually(lambda: counters.connections == 1000 and counters.clients == 0)
        assert eventually(lambda: len(os.listdir("/proc/self/fd")) <= before)
        with connected(server) as client:
            assert still_answers(client)
