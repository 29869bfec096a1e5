"""Tests of the allow list, alone and with a server on real sockets."""

import contextlib
import socket

import pytest

from pneuforce.support.allow_list import AllowList
from tests.registers.modbus.memory_source import MemorySource
from tests.registers.modbus.serving import connected, read_until_closed, send_request, serving, still_answers

ALLOW_LIST = AllowList(["192.168.1.0/24", "10.0.0.7", "fd00::/8"])
ALLOWED, NOT_ALLOWED = "127.0.0.2", "127.0.0.3"
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
        ("::ffff:192.168.1.9", True),  # IPv4 client of a socket for both address families
        ("::ffff:192.168.2.9", False),
        ("127.0.0.1", True),  # this machine
        ("::1", True),
        ("::ffff:127.0.0.1", True),
        ("127.0.0.2", False),
        ("", False),
    ],
)
def test_listed_addresses_and_this_machine_may_connect(address, admitted):
    assert ALLOW_LIST.admits(address) is admitted


def test_an_empty_list_allows_every_address():
    assert AllowList([]).admits("203.0.113.9")


def test_a_connection_from_another_address_is_closed_at_once_and_cannot_vent():
    source = MemorySource()
    source.values["mode"] = "hold"
    with serving(source, allow=(ALLOWED,)) as server:
        for address in ("127.0.0.1", ALLOWED):
            with connected(server, address) as client:
                assert still_answers(client)
        with connected(server, NOT_ALLOWED) as client, contextlib.suppress(ConnectionError):
            assert send_request(client, VENT) == ""
        assert source.write_requests == []
        assert (server.counters.not_allowed, server.counters.connections) == (1, 2)


def test_a_connection_from_another_address_evicts_no_connection():
    with (
        serving(MemorySource(), allow=(ALLOWED,), max_connections=2) as server,
        connected(server) as first,
        connected(server, ALLOWED) as second,
    ):
        for _ in range(20):
            with connected(server, NOT_ALLOWED) as client, contextlib.suppress(ConnectionError):
                assert read_until_closed(client) == b""
        assert still_answers(first)
        assert still_answers(second)
        assert (server.counters.not_allowed, server.counters.evicted, server.counters.clients) == (20, 0, 2)


def test_a_flood_of_rejected_connections_writes_only_a_few_log_lines(caplog):
    with serving(MemorySource(), allow=(ALLOWED,)) as server:
        for _ in range(200):
            connected(server, NOT_ALLOWED).close()
        with connected(server) as client:
            assert still_answers(client)
    assert "client 127.0.0.3 rejected" in caplog.text
    assert len(caplog.records) < 50


@pytest.mark.skipif(not socket.has_ipv6, reason="this Python has no IPv6")
def test_a_listed_ipv6_address_may_connect():
    try:
        with socket.create_server(("::1", 0), family=socket.AF_INET6):
            pass
    except OSError:
        pytest.skip("this machine has no IPv6 loopback")
    with serving(MemorySource(), host="::1", allow=("fd00::/8",)) as server:
        with socket.create_connection(("::1", server.port), timeout=10) as client:
            assert still_answers(client)
        assert server.counters.not_allowed == 0
