"""The server on real sockets: time-outs, limits, and clients that misbehave."""

import os
import socket
import struct
import threading
import time

from registers.modbus.mbap import frame
from tests.registers.modbus.memory import MemorySource
from tests.registers.modbus.serving import (
    FORCE,
    FORCE_ANSWER,
    connected,
    eventually,
    everything,
    exactly,
    received,
    serving,
    still_answers,
)


def test_a_frame_left_unfinished_ends_its_connection_however_slowly_it_grows():
    with (
        serving(MemorySource(), frame_s=0.3, idle_s=60) as server,
        connected(server) as client,
        connected(server) as other,
    ):
        begun = time.monotonic()
        for byte in frame(1, 1, bytes(200)):
            try:
                client.sendall(bytes((byte,)))
            except OSError:
                break
            time.sleep(0.02)
        assert 0.3 <= time.monotonic() - begun < 2.0
        assert still_answers(other)
        assert server.counters.timeouts == 1


def test_requests_that_overlap_segments_for_long_are_not_unfinished():
    with serving(MemorySource(), frame_s=0.2) as server, connected(server) as client:
        data = frame(1, 1, FORCE)
        client.sendall(data[:5])
        for _ in range(10):
            time.sleep(0.06)
            client.sendall(data[5:] + data[:5])
            assert received(client) == frame(1, 1, FORCE_ANSWER).hex(" ")


def test_an_idle_connection_is_closed_and_a_busy_one_is_not():
    with serving(MemorySource(), idle_s=0.3) as server, connected(server) as idle, connected(server) as busy:
        idle.setblocking(False)
        assert eventually(lambda: still_answers(busy) and closed(idle))
        assert still_answers(busy)


def closed(client):
    try:
        return client.recv(1) == b""
    except BlockingIOError:
        return False


def test_one_client_too_many_is_turned_away_and_the_others_stay():
    with serving(MemorySource(), most_connections=3) as server:
        clients = [connected(server) for _ in range(3)]
        assert all(map(still_answers, clients))
        with connected(server) as late:
            assert everything(late) == b""
        assert server.counters.turned_away == 1
        assert all(map(still_answers, clients))
        clients.pop().close()
        assert eventually(lambda: server.counters.clients == 2)
        with connected(server) as next_:
            assert still_answers(next_)
        for client in clients:
            client.close()


def test_a_client_that_never_reads_is_closed_and_the_others_do_not_notice():
    with (
        serving(MemorySource(), frame_s=0.5) as server,
        connected(server) as deaf,
        connected(server) as other,
    ):
        deaf.setblocking(False)
        requests = b"".join(frame(i, 1, bytes.fromhex("04 0000 007d")) for i in range(300))
        slowest = 0.0
        while server.counters.timeouts == 0:
            try:
                deaf.send(requests)
            except BlockingIOError:
                time.sleep(0.005)
            except OSError:
                break
            begun = time.monotonic()
            assert still_answers(other)
            slowest = max(slowest, time.monotonic() - begun)
        assert eventually(lambda: server.counters.clients == 1)
        assert server.counters.timeouts == 1
        assert slowest < 0.25


def test_a_client_that_does_not_read_is_read_no_further_until_it_does():
    with serving(MemorySource(), frame_s=1.0) as server, connected(server) as client:
        count, long_read = 60000, bytes.fromhex("04 0000 007d")
        stream = b"".join(frame(i & 0xFFFF, 1, long_read) for i in range(count))
        sender = threading.Thread(target=client.sendall, args=(stream,))
        sender.start()
        assert eventually(lambda: 0 < server.counters.requests == requests_a_moment_later(server))
        assert server.counters.requests < count
        stopped_s = time.monotonic()
        size = len(frame(0, 1, bytes(2 + 250)))
        answers = exactly(client, count * size)
        sender.join()
        assert [answers[i : i + 2] for i in range(0, len(answers), size)] == [
            struct.pack(">H", i & 0xFFFF) for i in range(count)
        ]
        time.sleep(max(0.0, stopped_s + 1.6 - time.monotonic()))
        assert still_answers(client), "it was closed although it has read everything"


def requests_a_moment_later(server):
    time.sleep(0.1)
    return server.counters.requests


def test_resets_and_a_thousand_connections_leave_nothing_behind():
    with serving(MemorySource()) as server:
        before = len(os.listdir("/proc/self/fd"))
        for i in range(1000):
            client = connected(server)
            client.sendall(frame(1, 1, FORCE)[: i % 12])
            if i % 2:  # RST instead of FIN
                client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            client.close()
        assert eventually(lambda: len(os.listdir("/proc/self/fd")) <= before)
        assert server.counters.clients == 0
        with connected(server) as client:
            assert still_answers(client)
