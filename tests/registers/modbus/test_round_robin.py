"""Tests of the round-robin scheduler with a flood of pipelined requests."""

import asyncio
import contextlib
import itertools
import socket
import struct
import time

from pneuforce.registers.modbus.mbap import MbapDecoder, encode_frame
from pneuforce.registers.modbus.round_robin import BUDGET_S, RoundRobinScheduler
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
    serving,
)

SNAPSHOT_S = 0.001
PIPELINED = b"".join(encode_frame(i, 1, FORCE) for i in range(40))
VENT = bytes.fromhex("06 0204 0000")


class SlowSource(MemorySource):
    """Source that needs a millisecond for each snapshot, and records the addresses of the peers."""

    def __init__(self, at_first=lambda: None):
        super().__init__()
        self.served = []
        self.at_first = at_first

    def snapshot(self, peer, now_s):
        if not self.served:
            self.at_first()
        self.served.append(peer.address)
        time.sleep(SNAPSHOT_S)
        return super().snapshot(peer, now_s)


def test_the_event_loop_runs_after_each_time_budget():
    source, served_before_each_pass = SlowSource(), []

    async def flooded():
        server = ModbusTcpServer(source, ModbusTcpOptions(port=0), IDENTITY)
        await server.start()
        with contextlib.ExitStack() as stack:
            for client in [stack.enter_context(connected(server)) for _ in range(10)]:
                client.sendall(PIPELINED)
            until_s = time.monotonic() + 600
            while len(source.served) < 400 and time.monotonic() < until_s:
                served_before_each_pass.append(len(source.served))
                await asyncio.sleep(0)
        server.close()

    asyncio.run(flooded())
    assert len(source.served) == 400
    steps = [b - a for a, b in itertools.pairwise(served_before_each_pass)]
    assert max(steps) <= BUDGET_S / SNAPSHOT_S + 1


def test_a_calm_client_is_answered_before_the_backlog_of_a_flood():
    calm = []
    source = SlowSource(at_first=lambda: calm[0].sendall(encode_frame(7, 1, FORCE)))
    with serving(source) as server, contextlib.ExitStack() as stack:
        calm.append(stack.enter_context(connected(server, "127.0.0.2")))
        flood = [stack.enter_context(connected(server)) for _ in range(5)]
        for client in flood:
            client.sendall(PIPELINED)
        assert read_answer(calm[0]) == encode_frame(7, 1, FORCE_ANSWER).hex(" ")
        assert eventually(lambda: len(source.served) == 201)
    assert source.served.index("127.0.0.2") < 40


def test_each_request_of_a_flood_is_answered_once_in_order_before_fin():
    with serving(MemorySource()) as server, contextlib.ExitStack() as stack:
        clients = [stack.enter_context(connected(server)) for _ in range(30)]
        for client in clients:
            client.sendall(PIPELINED * 3)
            client.shutdown(socket.SHUT_WR)
        for client in clients:
            assert MbapDecoder().feed(read_until_closed(client)) == 3 * [
                (i, 1, FORCE_ANSWER) for i in range(40)
            ]
        assert server.counters.requests == 3600


def test_a_client_with_pending_requests_is_not_read_further():
    """The server leaves further requests in the socket buffers, so that a flood cannot fill its memory."""
    source, waiting = SlowSource(), [0]

    def all_served():
        waiting.extend(len(connection._pending) for connection in list(server.connections))
        return len(source.served) == 120

    with serving(source) as server, connected(server) as client:
        client.sendall(PIPELINED * 3)
        assert eventually(all_served)
    assert 0 < max(waiting) <= 512 / 12 + 1


def test_a_received_vent_is_carried_out_though_its_client_has_reset_the_connection():
    clients = []
    source = SlowSource(at_first=lambda: clients[0].close())
    source.values["mode"] = "hold"
    with serving(source) as server:
        clients.append(connected(server))
        clients[0].setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        clients[0].sendall(PIPELINED[: 39 * 12] + encode_frame(9, 1, VENT))
        assert eventually(lambda: source.values["mode"] == "vent")
        assert eventually(lambda: server.counters.clients == 0)


class ScheduledClient:
    """Client with three requests, which logs the calls of the scheduler."""

    def __init__(self, name, log):
        self.name, self.log, self.left = name, log, 3

    def answer_next(self, now_s):
        self.log.append(self.name)
        self.left -= 1
        return self.left > 0

    def send_answers(self):
        self.log.append(f"{self.name}!")

    def pause_reading(self):
        self.log.append(f"{self.name}-")


def test_all_clients_share_one_budget_of_time_in_a_round_robin():
    log, ticks = [], itertools.count()

    async def three():
        scheduler = RoundRobinScheduler(lambda: next(ticks) * BUDGET_S / 2)  # two answers per pass
        for name in "abc":
            scheduler.add(ScheduledClient(name, log))
        while log.count("c!") < 3:
            log.append("|")
            await asyncio.sleep(0)

    asyncio.run(asyncio.wait_for(three(), 10))
    # One text per pass. "a": client a is answered; "a!": its answers are sent; "a-": reading from a pauses.
    assert "".join(log).split("|")[1:] == ["aba!b!c-a-b-", "cac!a!b-c-a-", "bcb!c!a-b-c-", "abca!b!c!"]
