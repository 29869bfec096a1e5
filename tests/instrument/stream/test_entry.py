"""Tests of the encoding, decoding and broadcasting of entries."""

import math
import struct
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuforce.instrument.measurement.measurement import Measurement, Quality
from pneuforce.instrument.recording.broadcaster import MAX_BACKLOG_BYTES, EntryBroadcaster, Subscriber
from pneuforce.instrument.rig.link import RawSample
from pneuforce.instrument.stream.entry import (
    HEAD,
    EntryDecoder,
    EntryKind,
    StreamEntry,
    StreamError,
    encode,
    json_entry,
)
from pneuforce.instrument.stream.sample_record import SampleRecord, pack, unpack
from pneuforce.protocol.frames import Sample

entries = st.builds(
    StreamEntry, st.sampled_from(EntryKind), st.floats(allow_nan=False), st.binary(max_size=200)
)


@given(st.lists(entries, max_size=8), st.integers(1, 30))
def test_entries_are_decoded_from_pieces_of_any_size(sent, step):
    data, decoder = b"".join(map(encode, sent)), EntryDecoder()
    decoded = [e for at in range(0, len(data), step) for e in decoder.feed(data[at : at + step])]
    assert decoded == sent
    assert not decoder.has_partial_entry


@given(st.binary(min_size=HEAD.size, max_size=100))
def test_invalid_bytes_raise_nothing_but_a_stream_error(data):
    with suppress(StreamError):
        EntryDecoder().feed(data)


@pytest.mark.parametrize("limit", [0, 1, 1000])
def test_a_body_longer_than_the_limit_is_rejected_by_its_header(limit):
    body = bytes(limit)
    assert EntryDecoder(limit).feed(encode(StreamEntry(EntryKind.EVENT, 1.0, body))) == [
        StreamEntry(EntryKind.EVENT, 1.0, body)
    ]
    with pytest.raises(StreamError, match=f"{limit + 1} bytes"):
        EntryDecoder(limit).feed(HEAD.pack(limit + 1, EntryKind.EVENT, 1.0))


def test_a_body_that_is_not_json_is_rejected():
    with pytest.raises(StreamError, match="EVENT"):
        _ = StreamEntry(EntryKind.EVENT, 0.0, b"{").json_body


def test_a_sample_record_is_unpacked_with_its_nans():
    raw = RawSample(65535, 12.5, Sample(1, 2, 3, 3, 4, 5, 6, 7, 8), 0.002, True, False)
    m = Measurement(t_s=12.5, pressure_kpa=8.1, force_n=-0.0, in_contact=True, quality=Quality.SENSOR_FAULT)
    sample = unpack(pack(raw, m))
    assert sample[:13] == (65535, 1, 2, 3, 3, 4, 5, 6, 7, 8, 0.002, True, False)
    assert (sample.t_s, sample.pressure_kpa, sample.in_contact, sample.quality) == (
        12.5,
        8.1,
        True,
        Quality.SENSOR_FAULT.value,
    )
    assert math.copysign(1, sample.force_n) == -1
    assert math.isnan(sample.rise_kpa)
    assert SampleRecord._fields[13:] == Measurement._fields
    with pytest.raises(struct.error):
        unpack(pack(raw, m)[:-1])


def test_each_subscriber_receives_the_kinds_of_its_subscription():
    broadcaster = EntryBroadcaster()
    broadcaster.record(EntryKind.TICK, 1.0, b"\0")  # no subscriber yet
    recorder, web = Subscriber("record"), Subscriber("web")
    broadcaster.subscribers += [recorder, web]
    for kind in (EntryKind.TICK, EntryKind.SAMPLE, EntryKind.EVENT):
        broadcaster.record(kind, 2.0)
    broadcaster.publish_json(EntryKind.SNAPSHOT, 2.0, {"force_n": None})
    received = [
        [e.kind for e in EntryDecoder().feed(subscriber.take_all())] for subscriber in (recorder, web)
    ]
    assert received == [
        [EntryKind.TICK, EntryKind.SAMPLE, EntryKind.EVENT],
        [EntryKind.SAMPLE, EntryKind.EVENT, EntryKind.SNAPSHOT],
    ]
    assert (recorder.take_all(), recorder.backlog_bytes) == (b"", 0)


def test_an_unknown_subscription_is_rejected():
    with pytest.raises(KeyError):
        Subscriber("everything")


def test_the_backlog_of_a_subscriber_is_limited():
    broadcaster, subscriber = EntryBroadcaster(), Subscriber("record")
    broadcaster.subscribers.append(subscriber)
    body = bytes(100_000)
    for _ in range(200):
        broadcaster.record(EntryKind.RECEIVED, 0.0, body)
    assert MAX_BACKLOG_BYTES < subscriber.backlog_bytes < MAX_BACKLOG_BYTES + 2 * len(body)


def test_a_json_body_is_decoded_to_the_same_value():
    value = {"values": {"mode": ["vent", "hold"]}, "n": 1.25}
    assert json_entry(EntryKind.EVENT, 1.0, value).json_body == value
