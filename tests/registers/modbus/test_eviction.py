"""Tests of the order in which connections are evicted, in virtual time."""

from dataclasses import dataclass, field

import pytest

from pneuforce.registers.modbus.eviction import Activity, RequestRhythm, select_evicted

PLC, CROWD = "10.0.0.5", "10.0.0.9"


@dataclass
class Client:
    address: str = CROWD
    rhythm: RequestRhythm = field(default_factory=RequestRhythm)
    last_received_s: float = 0.0

    def polls(self, period_s, until_s, from_s=0.0):
        """Send one request per period."""
        for n in range(1, round((until_s - from_s) / period_s) + 1):
            self.last_received_s = from_s + n * period_s
            self.rhythm.add(self.last_received_s)
        return self


def connects(at_s, address=CROWD):
    return Client(address, last_received_s=at_s)


@pytest.mark.parametrize(
    ("client", "activity"),
    [
        (connects(9.99), Activity.NO_REQUEST),
        (Client().polls(0.1, 0.2), Activity.IDLE),
        (connects(9.9).polls(0.05, 10.0, from_s=9.9), Activity.IDLE),  # two requests
        (Client().polls(0.05, 10.0), Activity.POLLING),
        (Client().polls(5.0, 10.0, from_s=-10.0), Activity.POLLING),
        (Client().polls(0.05, 9.6), Activity.POLLING),
        (Client().polls(0.05, 9.4), Activity.IDLE),
        (Client().polls(2.0, 4.0, from_s=-4.0), Activity.POLLING),
        (Client().polls(2.0, 2.0, from_s=-6.0), Activity.IDLE),
    ],
)
def test_a_client_that_keeps_its_interval_polls(client, activity):
    assert client.rhythm.activity(10.0) is activity


@pytest.mark.parametrize("address", [PLC, CROWD])
def test_200_new_connections_do_not_evict_a_client_that_polls_20_times_per_second(address):
    plc = Client(PLC).polls(0.05, 10.0)
    connections = [plc, *(connects(10.0 + n * 1e-3, address) for n in range(63))]
    for n in range(200):
        now_s = 10.04
        evicted = select_evicted(connections, address, now_s)
        assert evicted is not plc
        connections.remove(evicted)
        connections.append(connects(now_s + n * 1e-6, address))


def test_a_crowd_of_which_each_client_sends_one_request_does_not_evict_a_client_that_polls():
    plc = Client(PLC).polls(0.2, 10.0)
    crowd = [connects(9.9, PLC).polls(0.01, 9.91 + n * 1e-4, from_s=9.9 + n * 1e-4) for n in range(63)]
    assert select_evicted([*crowd, plc], PLC, 10.1) in crowd


def test_of_clients_that_poll_from_many_addresses_the_latest_is_evicted():
    plc = Client(PLC).polls(0.2, 10.0)
    crowd = [Client(f"10.0.1.{n}").polls(0.1, 10.0, from_s=5.0 + n / 100) for n in range(70)]
    assert select_evicted([plc, *crowd], "10.0.2.1", 10.0) is crowd[-1]


def test_two_idle_connections_of_one_address_are_spared_if_others_have_sent_no_request():
    idle = [Client(PLC).polls(0.1, 1.0) for _ in range(2)]
    silent = [connects(2.0 + n, f"10.0.1.{n}") for n in range(62)]
    assert select_evicted([*idle, *silent], "10.0.2.1", 100.0) is silent[0]


def test_among_idle_clients_the_address_with_the_most_connections_and_then_the_longest_silence_decides():
    plc = Client(PLC).polls(0.1, 1.0)
    crowd = [Client(CROWD).polls(0.1, until_s) for until_s in (3.0, 2.0, 4.0)]
    assert select_evicted([plc, *crowd], PLC, 60.0) is crowd[1]
    assert select_evicted([plc, crowd[0]], PLC, 60.0) is plc
