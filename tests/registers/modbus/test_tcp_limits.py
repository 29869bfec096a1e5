"""The server on real sockets: time-outs, limits, and clients that misbehave."""

import contextlib
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
    asked,
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
        begun, data, sent = time.monotonic(), frame(1, 1, bytes(200)), 0
        with contextlib.suppress(OSError):
            for sent in range(len(data) - 1):  # the last byte would complete it
                client.sendall(data[sent : sent + 1])
                time.sleep(0.02)
        assert sent < 200, "it was left to grow"
        assert time.monotonic() - begun >= 0.3
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


FLOODER, PLC = "127.0.0.1", "127.0.0.2"


def test_a_flood_from_one_address_evicts_itself_and_another_peer_vents():
    source = MemorySource()
    with serving(source, most_connections=4) as server, contextlib.ExitStack() as stack:
        plc = stack.enter_context(connected(server, PLC))
        assert still_answers(plc)
        flood = [stack.enter_context(connected(server)) for _ in range(20)]
        assert all(everything(client) == b"" for client in flood[:-3])
        assert all(map(still_answers, flood[-3:]))
        source.values["mode"] = "hold"
        newcomer = stack.enter_context(connected(server, PLC))
        assert asked(newcomer, "0001 0000 0006 01 06 0204 0000") == "00 01 00 00 00 06 01 06 02 04 00 00"
        assert source.values["mode"] == "vent"
        assert still_answers(plc)
        assert (server.counters.evicted, server.counters.clients) == (18, 4)


def test_of_the_address_with_most_connections_the_one_silent_for_longest_goes():
    with serving(MemorySource(), most_connections=3) as server, contextlib.ExitStack() as stack:
        oldest, silent, busy = (stack.enter_context(connected(server)) for _ in range(3))
        for client in (oldest, silent, busy, oldest):
            assert still_answers(client)
        newcomer = stack.enter_context(connected(server, PLC))
        assert still_answers(newcomer)
        assert everything(silent) == b""
        assert all(map(still_answers, (oldest, busy, newcomer)))


def test_the_newcomer_counts_with_its_own_address_and_stays():
    with serving(MemorySource(), most_connections=4) as server, contextlib.ExitStack() as stack:
        plc = [stack.enter_context(connected(server, PLC)) for _ in range(2)]
        flood = [stack.enter_context(connected(server, FLOODER)) for _ in range(2)]
        for client in plc + flood:  # the PLC's are silent for longest
            assert still_answers(client)
        newcomer = stack.enter_context(connected(server, FLOODER))
        assert still_answers(newcomer)
        assert everything(flood[0]) == b""
        assert all(map(still_answers, (*plc, flood[1])))


def test_a_client_that_never_reads_is_closed_and_the_others_do_not_notice():
    with (
        serving(MemorySource(), frame_s=0.5) as server,
        connected(server) as deaf,
        connected(server) as other,
    ):
        deaf.setblocking(False)
        requests = b"".join(frame(i, 1, bytes.fromhex("04 0000 007d")) for i in range(300))
        while server.counters.timeouts == 0:
            try:
                deaf.send(requests)
            except BlockingIOError:
                time.sleep(0.005)
            except OSError:
                break
            assert still_answers(other)
        assert eventually(lambda: server.counters.clients == 1)
        assert server.counters.timeouts == 1
        assert still_answers(other)


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
        counters = server.counters
        assert eventually(lambda: counters.connections == 1000 and counters.clients == 0)
        assert eventually(lambda: len(os.listdir("/proc/self/fd")) <= before)
        with connected(server) as client:
            assert still_answers(client)
