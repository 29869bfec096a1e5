"""Tests of the RDT server on real UDP sockets: records, refused requests, clients that are gone, floods."""

import logging
import math
import socket
import struct
from contextlib import ExitStack

import pytest

from pneuforce.registers.rdt.record import (
    FULL_SCALE_COUNTS,
    STATUS_INVALID,
    STATUS_VALID,
    RdtCommand,
    encode_request,
)
from pneuforce.registers.rdt.server import MAX_AGE_S, MAX_REQUESTS_READ, STALE_PERIOD_S
from pneuforce.registers.rdt.streams import MAX_STREAMS
from pneuforce.support.throttle import MAX_LINES
from tests.registers.rdt.serving import client_of, received, serving, start

STALE = frozenset(("stale", "stale_or_lost", "failure"))
START = encode_request(RdtCommand.START_REALTIME)
#: Datagrams that have no effect, from a client without a stream.
REFUSED = {
    "an empty datagram": b"",
    "one byte": b"\x12",
    "the header only": b"\x12\x34",
    "a start that is one byte short": START[:-1],
    "a start that is one byte long": START + b"\0",
    "two starts": START * 2,
    "a start in little-endian order": struct.pack("<HHI", 0x1234, 2, 0),
    "the header reversed": b"\x34\x12" + START[2:],
    "the header 0000h": bytes(2) + START[2:],
    "the header 1235h": b"\x12\x35" + START[2:],
    "a record instead of a request": bytes(36),
    "a datagram of 1400 bytes": START + bytes(1392),
    "a datagram of 65000 bytes": bytes(65000),
    "text": b"START\r\n\0",
    "a Modbus frame with the length of a request": bytes.fromhex("00010000 00020107"),
    "a Modbus frame that vents": bytes.fromhex("000100000006010602040000"),
    "a CAN hub message": b"< open can0 >",
    "HTTP": b"GET /netftapi2.xml HTTP/1.0\r\n\r\n",
    "an extended request for records to a multicast address": bytes.fromhex("1234800200000000e00005806e5a"),
    "command 4, multi-unit": encode_request(RdtCommand.START_MULTI_UNIT),
    "command 5": encode_request(5),
    "command 40h": encode_request(0x40),
    "command 42h, bias": encode_request(RdtCommand.SET_BIAS),
    "command 42h with a count": encode_request(RdtCommand.SET_BIAS, 0xFFFFFFFF),
    "command 43h": encode_request(0x43),
    "command 0200h": encode_request(0x0200),
    "command 8002h": encode_request(0x8002),
    "command FFFFh": encode_request(0xFFFF, 0xFFFFFFFF),
    "all bits set": b"\xff" * 8,
    "all bits clear": bytes(8),
}
NO_EFFECT = {
    "a stop without a stream": encode_request(RdtCommand.STOP),
    "a stop with a count": encode_request(RdtCommand.STOP, 7),
    "a reset of the threshold latch": encode_request(RdtCommand.RESET_THRESHOLD_LATCH),
}


@pytest.mark.parametrize("command", [1, RdtCommand.START_REALTIME, RdtCommand.START_BUFFERED])
def test_each_sample_gives_one_record(command):
    with serving() as loop, client_of(loop) as client:
        start(client, command=command)
        loop.samples(3)
        loop.tick()
        records = received(client)
    assert [(r.rdt_sequence, r.ft_sequence) for r in records] == [(1, 1), (2, 2), (3, 3)]
    assert {(r.status, r.force_n) for r in records} == {(STATUS_VALID, 1.25)}


def test_a_stop_ends_the_stream():
    with serving() as loop, client_of(loop) as client:
        start(client)
        loop.samples(2)
        client.send(encode_request(RdtCommand.STOP))
        loop.samples(2)
        assert len(received(client)) == 2


def test_a_client_receives_as_many_records_as_it_requests():
    with serving() as loop, client_of(loop) as client:
        for count in (1, 5):
            start(client, count)
            loop.samples(9)
            assert [r.rdt_sequence for r in received(client)] == list(range(1, count + 1))


@pytest.mark.parametrize(
    "values",
    [
        {"status": frozenset(), "force_n": 1.25},
        {"status": frozenset(), "force_n": math.nan},
        {"status": frozenset(("force_valid", "out_of_range")), "force_n": 0.0},
        {"force_n": math.nan},
        {"force_n": math.inf},
        {"status": STALE, "force_n": 0.0},
    ],
    ids=["not valid", "not valid, NaN", "out of range", "NaN", "infinite", "stale"],
)
def test_without_a_valid_force_the_record_is_serious_and_at_full_scale(values):
    with serving() as loop, client_of(loop) as client:
        start(client)
        loop.source.set(**values)
        loop.samples()
        [record] = received(client)
    assert (record.status, record.fz) == (STATUS_INVALID, FULL_SCALE_COUNTS)


def test_missing_samples_give_records_without_a_force():
    """A client that only receives would otherwise show the last force for ever."""
    with serving() as loop, client_of(loop) as client:
        start(client)
        loop.samples()
        loop.source.set(status=STALE, force_n=math.nan)
        for _ in range(100):
            loop.tick()
        valid, *stale = received(client)
    assert valid.is_valid
    assert not any(record.is_valid for record in stale)
    assert {record.ft_sequence for record in stale} == {valid.ft_sequence}
    assert len(stale) == pytest.approx(1.0 / STALE_PERIOD_S, abs=1)


def test_a_force_from_before_a_stall_is_not_sent_as_valid():
    """The process can be stopped between the read of a sample and the send of its record."""
    with serving() as loop, client_of(loop) as client:
        start(client)
        for stall_s in (0.0, MAX_AGE_S + 0.01, 0.0):
            loop.stall_s = stall_s
            loop.samples()
        assert [record.is_valid for record in received(client)] == [True, False, True]


def test_a_late_sample_gives_no_record_at_a_tick():
    with serving() as loop, client_of(loop) as client:
        start(client)
        loop.samples()
        loop.tick(STALE_PERIOD_S)  # the source is not stale
        assert len(received(client)) == 1


@pytest.mark.parametrize("name", [*REFUSED, *NO_EFFECT])
def test_a_malformed_or_unsupported_request_changes_nothing(name):
    """The sender gets no answer, another client gets all its records, and nothing is written."""
    with serving() as loop, client_of(loop) as other, client_of(loop) as client:
        start(other)
        loop.samples()
        client.send({**REFUSED, **NO_EFFECT}[name])
        loop.samples(3)
        loop.tick()
        assert received(client) == []
        assert [r.rdt_sequence for r in received(other)] == [1, 2, 3, 4]
        assert (loop.source.written, loop.source.rejected_writes) == ([], [])
        assert loop.server.counters.refused == (name in REFUSED)
        start(client)
        loop.samples()
        assert len(received(client)) == 1


@pytest.mark.parametrize(
    "data", [START, encode_request(RdtCommand.STOP), b""], ids=["start", "stop", "empty"]
)
def test_an_address_that_is_not_allowed_has_no_effect(data):
    with (
        serving(host="0.0.0.0", allow=("127.0.0.7",)) as loop,
        client_of(loop, "127.0.0.7") as allowed,
        client_of(loop, "127.0.0.8") as other,
    ):
        start(allowed)
        loop.samples()
        other.send(data)
        loop.samples()
        assert received(other) == []
        assert len(received(allowed)) == 2
        assert loop.server.counters.refused == 1


def test_a_request_stops_only_the_stream_of_its_own_port():
    with serving() as loop, client_of(loop) as client, client_of(loop) as other:
        start(client)
        loop.samples()
        other.send(encode_request(RdtCommand.STOP))
        loop.samples()
        assert len(received(client)) == 2


def test_bias_leaves_the_force_of_a_stream_as_it_is(caplog):
    with serving() as loop, client_of(loop) as client:
        start(client)
        loop.samples()
        for _ in range(20):
            client.send(encode_request(RdtCommand.SET_BIAS))
            loop.samples()
        assert {record.force_n for record in received(client)} == {1.25}
        assert loop.server.counters.refused == 20
    assert len(caplog.records) == MAX_LINES


def test_a_fifth_client_is_refused_and_the_others_go_on(caplog):
    with serving() as loop, ExitStack() as stack:
        clients = [stack.enter_context(client_of(loop)) for _ in range(MAX_STREAMS + 1)]
        for client in clients:
            start(client)
            loop.tick()
        loop.samples(5)
        assert [len(received(client)) for client in clients] == [5] * MAX_STREAMS + [0]
    assert [record.levelno for record in caplog.records] == [logging.WARNING]


def test_a_closed_client_loses_its_place_at_once_and_others_lose_no_record():
    with serving() as loop, ExitStack() as stack:
        clients = [stack.enter_context(client_of(loop)) for _ in range(MAX_STREAMS)]
        for client in clients:
            start(client)
            loop.tick()
        loop.samples()
        for client in clients[:-1]:  # their errors are reported when the last client is served
            client.close()
        loop.samples(4)
        assert len(loop.server.streams) == 1
        with client_of(loop) as new:
            start(new)
            loop.samples(2)
            assert len(received(new)) == 2
        assert [r.rdt_sequence for r in received(clients[-1])] == list(range(1, 8))


def test_a_stream_ends_after_the_configured_time():
    with serving(stream_timeout_s=1.0) as loop, client_of(loop) as client:
        start(client)
        loop.samples()
        loop.tick(0.9)
        start(client)
        loop.tick(0.0)
        loop.tick(0.9)
        assert len(loop.server.streams) == 1
        loop.tick(0.2)
        assert len(loop.server.streams) == 0


def test_a_flood_costs_a_bounded_number_of_reads():
    with serving() as loop, client_of(loop) as client:
        for _ in range(100):
            client.send(b"flood")
        loop.samples()
        assert loop.server.counters.requests == MAX_REQUESTS_READ
        loop.tick()
        assert loop.server.counters.requests == 2 * MAX_REQUESTS_READ


def test_a_flood_does_not_hide_other_reasons_in_the_log(caplog):
    with serving() as loop, client_of(loop) as client:
        for _ in range(100):
            client.send(b"flood")
            loop.tick(0.0)
        client.send(encode_request(RdtCommand.SET_BIAS))
        loop.tick(0.0)
    assert len(caplog.records) == MAX_LINES + 1


def test_a_closed_server_leaves_no_client_with_a_valid_force():
    with serving() as loop, client_of(loop) as client:
        start(client)
        loop.samples()
        loop.server.close()
        assert [record.is_valid for record in received(client)] == [True, False]


def test_a_server_without_an_open_port_does_nothing():
    with serving() as loop, client_of(loop) as client:
        start(client)
        loop.server.close()
        loop.samples()
        loop.tick()
        assert received(client) == []


def test_an_ipv6_client_is_served_and_loses_its_place_when_it_is_closed():
    with serving(host="::1") as loop:
        with socket.socket(socket.AF_INET6, socket.SOCK_DGRAM) as client:
            client.connect(("::1", loop.server.port))
            client.setblocking(False)
            start(client)
            loop.samples(2)
            assert len(received(client)) == 2
        loop.samples(3)
        assert len(loop.server.streams) == 0
