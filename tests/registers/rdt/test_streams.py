"""Tests of the streams: number of clients, sample counts, sequence numbers and time-outs."""

import math

import pytest

from pneuforce.registers.rdt.record import decode_record
from pneuforce.registers.rdt.streams import MAX_STREAMS, RdtStreams

A, B = ("192.0.2.1", 5000), ("192.0.2.1", 5001)


def sequences(streams, count=1):
    """Return the sequence numbers of the next records of each client."""
    sent = {}
    for number in range(count):
        for address, data in streams.next_records(number, 0.0):
            sent.setdefault(address, []).append(decode_record(data).rdt_sequence)
    return sent


def test_each_client_has_its_own_sequence_from_one():
    streams = RdtStreams()
    streams.start(A, 0, 0.0)
    assert sequences(streams, 2) == {A: [1, 2]}
    streams.start(B, 0, 0.0)
    assert sequences(streams, 2) == {A: [3, 4], B: [1, 2]}


def test_a_stream_ends_after_the_requested_number_of_records():
    streams = RdtStreams()
    streams.start(A, 3, 0.0)
    assert sequences(streams, 9) == {A: [1, 2, 3]}
    assert len(streams) == 0


def test_a_stopped_stream_begins_again_at_one():
    streams = RdtStreams()
    streams.start(A, 0, 0.0)
    assert sequences(streams, 2) == {A: [1, 2]}
    streams.stop(A)
    streams.stop(B)
    assert sequences(streams) == {}
    streams.start(A, 0, 0.0)
    assert sequences(streams) == {A: [1]}


def test_a_renewed_start_continues_the_sequence_with_the_new_count():
    """Clients discard a record whose number is lower than that of an earlier record."""
    streams = RdtStreams()
    streams.start(A, 0, 0.0)
    assert sequences(streams, 2) == {A: [1, 2]}
    streams.start(A, 2, 0.0)
    assert sequences(streams, 9) == {A: [3, 4]}


def test_a_fifth_client_is_refused_until_another_has_stopped():
    streams = RdtStreams()
    clients = [("192.0.2.1", port) for port in range(5000, 5000 + MAX_STREAMS)]
    assert all(streams.start(client, 0, 0.0) for client in clients)
    fifth = ("192.0.2.2", 5000)
    assert not streams.start(fifth, 0, 0.0)
    assert streams.start(clients[0], 0, 0.0)
    assert set(sequences(streams)) == set(clients)
    streams.stop(clients[0])
    assert streams.start(fifth, 0, 0.0)


def test_a_stream_never_ends_by_time_without_a_timeout():
    streams = RdtStreams()
    streams.start(A, 0, 0.0)
    streams.expire(1e9)
    assert len(streams) == 1


@pytest.mark.parametrize(("now_s", "left"), [(10.0, 2), (10.1, 1), (14.1, 0), (math.nan, 0)])
def test_a_stream_without_a_renewed_start_ends_after_the_timeout(now_s, left):
    streams = RdtStreams(timeout_s=10.0)
    for address in (A, B):
        streams.start(address, 0, 0.0)
    streams.start(B, 0, 4.0)
    streams.expire(now_s)
    assert len(streams) == left


def test_a_record_contains_the_sample_counter_and_the_force():
    streams = RdtStreams()
    streams.start(A, 0, 0.0)
    [(_, valid)] = streams.next_records(77, 1.25)
    [(_, invalid)] = streams.next_records(78, math.nan)
    assert (decode_record(valid).ft_sequence, decode_record(valid).force_n) == (77, 1.25)
    assert decode_record(invalid).ft_sequence == 78
    assert not decode_record(invalid).is_valid
