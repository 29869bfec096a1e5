"""A flood of pipelined requests: the loop goes on in between, and everyone has a turn."""

import asyncio
import contextlib
import itertools
import socket
import struct
import time

from registers.modbus.mbap import Decoder, frame
from registers.modbus.tcp import ModbusTcpServer, Options
from registers.modbus.turns import BUDGET_S, Turns
from tests.registers.modbus.memory import MemorySource
from tests.registers.modbus.serving import (
    FORCE,
    FORCE_ANSWER,
    IDENTITY,
    connected,
    eventually,
    everything,
    received,
    serving,
)

SNAPSHOT_S = 0.001
PIPELINED = b"".join(frame(i, 1, FORCE) for i in range(40))
VENT = bytes.fromhex("06 0204 0000")


class Slow(MemorySource):
    """Takes a millisecond for each snapshot, and tells whose it was."""

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


def test_the_loop_goes_on_after_each_few_milliseconds_of_answering():
    source, served_before_each_pass = Slow(), []

    async def flooded():
        server = ModbusTcpServer(source, Options(port=0), IDENTITY)
        await server.start()
        with contextlib.ExitStack() as stack:
            for client in [stack.enter_context(connected(server)) for _ in range(10)]:
                client.sendall(PIPELINED)
            until_s = time.monotonic() + 30
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
    source = Slow(at_first=lambda: calm[0].sendall(frame(7, 1, FORCE)))
    with serving(source) as server, contextlib.ExitStack() as stack:
        calm.append(stack.enter_context(connected(server, "127.0.0.2")))
        flood = [stack.enter_context(connected(server)) for _ in range(5)]
        for client in flood:
            client.sendall(PIPELINED)
        assert received(calm[0]) == frame(7, 1, FORCE_ANSWER).hex(" ")
        assert eventually(lambda: len(source.served) == 201)
    assert source.served.index("127.0.0.2") < 40


def test_each_request_of_a_flood_is_answered_once_in_order_and_then_fin():
    with serving(MemorySource()) as server, contextlib.ExitStack() as stack:
        clients = [stack.enter_context(connected(server)) for _ in range(30)]
        for client in clients:
            client.sendall(PIPELINED * 3)
            client.shutdown(socket.SHUT_WR)
        for client in clients:
            assert Decoder().feed(everything(client)) == 3 * [(i, 1, FORCE_ANSWER) for i in range(40)]
        assert server.counters.requests == 3600


def test_no_more_than_a_piece_is_read_of_a_client_whose_requests_wait():
    """Else a flood would fill the memory: what is not read yet stays with its sender."""
    source, waiting = Slow(), [0]

    def all_served():
        waiting.extend(len(connection._requests) for connection in list(server.connections))
        return len(source.served) == 120

    with serving(source) as server, connected(server) as client:
        client.sendall(PIPELINED * 3)
        assert eventually(all_served)
    assert 0 < max(waiting) <= 512 / 12 + 1


def test_a_vent_that_was_received_is_carried_out_though_its_client_resets_meanwhile():
    clients = []
    source = Slow(at_first=lambda: clients[0].close())
    source.values["mode"] = "hold"
    with serving(source) as server:
        clients.append(connected(server))
        clients[0].setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        clients[0].sendall(PIPELINED[: 39 * 12] + frame(9, 1, VENT))
        assert eventually(lambda: source.values["mode"] == "vent")
        assert eventually(lambda: server.counters.clients == 0)


class Client:
    """Has three requests, and says what becomes of it."""

    def __init__(self, name, said):
        self.name, self.said, self.left = name, said, 3

    def take_turn(self, now_s):
        self.said.append(self.name)
        self.left -= 1
        return self.left > 0

    def end_pass(self):
        self.said.append(f"{self.name}!")

    def hold(self):
        self.said.append(f"{self.name}-")


def test_all_clients_share_one_budget_of_time_in_a_round_robin():
    said, ticks = [], itertools.count()

    async def three():
        turns = Turns(lambda: next(ticks) * BUDGET_S / 2)  # two requests fill a pass
        for name in "abc":
            turns.join(Client(name, said))
        while said.count("c!") < 3:
            said.append("|")
            await asyncio.sleep(0)

    asyncio.run(asyncio.wait_for(three(), 10))
    # of each pass: whose requests are answered, who is sent its answers, who is held until the next
    assert "".join(said).split("|")[1:] == ["aba!b!c-a-b-", "cac!a!b-c-a-", "bcb!c!a-b-c-", "abca!b!c!"]
