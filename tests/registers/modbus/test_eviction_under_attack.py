"""Tests of the eviction for hours of virtual time: a PLC polls, and an attacker connects again and again."""

from dataclasses import dataclass, field

import pytest

from pneuforce.registers.modbus.eviction import RequestRhythm, select_evicted

LIMIT, PLC = 64, "10.0.0.5"
HOUR_S = 3600.0


@dataclass(eq=False)
class Client:
    address: str
    period_s: float
    next_s: float
    rhythm: RequestRhythm = field(default_factory=RequestRhythm)
    last_received_s: float = 0.0


class Server:
    """Full server in virtual time. Every client polls with its own period until it is evicted."""

    def __init__(self):
        self.clients, self.evicted, self.now_s = [], [], 0.0

    def connect(self, address, period_s=0.2):
        client = Client(address, period_s, self.now_s + period_s, last_received_s=self.now_s)
        if len(self.clients) >= LIMIT:
            evicted = select_evicted(self.clients, address, self.now_s)
            self.clients.remove(evicted)
            self.evicted.append(evicted)
        self.clients.append(client)
        return client

    def run(self, seconds):
        until_s = self.now_s + seconds
        for client in self.clients:
            while client.next_s <= until_s:
                client.rhythm.add(client.next_s)
                client.last_received_s = client.next_s
                client.next_s += client.period_s
        self.now_s = until_s

    def attack(self, addresses, connections, wait_s, period_s=0.1):
        """Connect from each address in turn. The clients of the attacker poll in the same way as a PLC."""
        for n in range(connections):
            self.connect(f"10.0.1.{n % addresses}", period_s)
            self.run(wait_s)


@pytest.mark.parametrize("plc_connections", [1, 2])
@pytest.mark.parametrize("wait_s", [0.01, 0.3, 5.0])
def test_a_plc_that_has_polled_for_an_hour_never_loses_against_newcomers_from_70_addresses(
    plc_connections, wait_s
):
    server = Server()
    plc = [server.connect(PLC) for _ in range(plc_connections)]
    server.run(HOUR_S)
    server.attack(addresses=70, connections=400, wait_s=wait_s)
    assert len(server.evicted) == 400 + plc_connections - LIMIT
    assert not set(plc) & set(server.evicted)


@pytest.mark.parametrize("plc_connections", [1, 2])
@pytest.mark.parametrize("addresses", [1, 4, 16, 30])
def test_an_attacker_who_came_first_does_not_evict_a_plc_that_comes_later(addresses, plc_connections):
    server = Server()
    server.attack(addresses, connections=LIMIT, wait_s=1.0)
    server.run(HOUR_S)
    plc = []
    for _ in range(plc_connections):
        plc.append(server.connect(PLC))
        server.run(1.0)
    server.attack(addresses, connections=200, wait_s=1.0)
    assert not set(plc) & set(server.evicted)


def test_two_idle_connections_of_one_address_are_kept_while_63_silent_clients_connect():
    server = Server()
    plc = [server.connect(PLC) for _ in range(2)]
    server.run(2.0)
    for client in plc:
        client.next_s = float("inf")
    server.run(20.0)
    for n in range(63):
        server.connect(f"10.0.1.{n}", period_s=float("inf"))
        server.run(0.01)
    assert len(server.evicted) == 1
    assert not set(plc) & set(server.evicted)


def test_a_plc_that_comes_last_can_always_connect_and_loses_only_against_newer_clients():
    """If each of 64 addresses polls, no rule can tell the PLC from an attacker."""
    server = Server()
    server.attack(addresses=64, connections=LIMIT, wait_s=1.0)
    server.run(60.0)
    plc = server.connect(PLC)
    server.run(60.0)
    assert plc in server.clients
    server.connect("10.0.1.70")
    assert plc not in server.clients
    assert server.connect(PLC) in server.clients
