"""The list of those that may connect, alone and on real sockets."""

import contextlib
import socket

import pytest

from registers.modbus.allow import AllowList
from tests.registers.modbus.memory import MemorySource
from tests.registers.modbus.serving import asked, connected, everything, serving, still_answers

FACTORY = AllowList(["192.168.1.0/24", "10.0.0.7", "fd00::/8"])
NEIGHBOUR, FOREIGN = "127.0.0.2", "127.0.0.3"
VENT = "0001 0000 0006 01 06 0204 0000"


@pytest.mark.parametrize(
    ("address", "admitted"),
    [
        ("192.168.1.0", True),
        ("192.168.1.255", True),
        ("192.168.2.0", False),
        ("10.0.0.7", True),
        ("10.0.0.70", False),
        ("fd12::1", True),
        ("fe80::1%eth0", False),
        ("::ffff:192.168.1.9", True),  # an IPv4 client of a socket that listens to both families
        ("::ffff:192.168.2.9", False),
        ("127.0.0.1", True),  # this machine
        ("::1", True),
        ("::ffff:127.0.0.1", True),
        ("127.0.0.2", False),
        ("", False),
    ],
)
def test_who_is_named_and_this_machine_may_connect(address, admitted):
    assert FACTORY.admits(address) is admitted


def test_where_nobody_is_named_everyone_may():
    assert AllowList([]).admits("203.0.113.9")


def test_who_is_not_named_is_closed_at_once_and_cannot_vent():
    source = MemorySource()
    source.values["mode"] = "hold"
    with serving(source, allow=(NEIGHBOUR,)) as server:
        for own in ("127.0.0.1", NEIGHBOUR):
            with connected(server, own) as client:
                assert still_answers(client)
        with connected(server, FOREIGN) as client, contextlib.suppress(ConnectionError):
            assert asked(client, VENT) == ""
        assert source.asked == []
        assert (server.counters.foreign, server.counters.connections) == (1, 2)


def test_who_is_not_named_takes_nobodys_place():
    with (
        serving(MemorySource(), allow=(NEIGHBOUR,), most_connections=2) as server,
        connected(server) as first,
        connected(server, NEIGHBOUR) as second,
    ):
        for _ in range(20):
            with connected(server, FOREIGN) as client, contextlib.suppress(ConnectionError):
                assert everything(client) == b""
        assert still_answers(first)
        assert still_answers(second)
        assert (server.counters.foreign, server.counters.evicted, server.counters.clients) == (20, 0, 2)


def test_a_flood_of_foreign_connections_is_a_few_lines_in_the_log(caplog):
    with serving(MemorySource(), allow=(NEIGHBOUR,)) as server:
        for _ in range(200):
            connected(server, FOREIGN).close()
        with connected(server) as client:
            assert still_answers(client)
    assert "client 127.0.0.3 turned away" in caplog.text
    assert len(caplog.records) < 50


@pytest.mark.skipif(not socket.has_ipv6, reason="this Python has no IPv6")
def test_an_ipv6_neighbour_connects_as_an_ipv4_one_does():
    try:
        with socket.create_server(("::1", 0), family=socket.AF_INET6):
            pass
    except OSError:
        pytest.skip("this machine has no IPv6 loopback")
    with serving(MemorySource(), host="::1", allow=("fd00::/8",)) as server:
        with socket.create_connection(("::1", server.port), timeout=10) as client:
            assert still_answers(client)
        assert server.counters.foreign == 0
