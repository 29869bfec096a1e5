"""Entries: what is put in comes out, however it is cut; what is none is refused."""

import math
import struct
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from instrument.measurement import Measurement, Quality
from instrument.rig.frames import Sample
from instrument.rig.link import RawSample
from instrument.tape.entry import HEAD, Decoder, Entry, Kind, TapeError, encode, told
from instrument.tape.feed import MOST_BACKLOG, Feed, Listener
from instrument.tape.measured import Measured, pack, unpack

entries = st.builds(Entry, st.sampled_from(Kind), st.floats(allow_nan=False), st.binary(max_size=200))


@given(st.lists(entries, max_size=8), st.integers(1, 30))
def test_entries_come_out_as_they_went_in_however_they_are_cut(sent, step):
    data, decoder = b"".join(map(encode, sent)), Decoder()
    heard = [e for at in range(0, len(data), step) for e in decoder.feed(data[at : at + step])]
    assert heard == sent
    assert not decoder.unfinished


@given(st.binary(min_size=HEAD.size, max_size=100))
def test_bytes_that_are_no_entries_are_refused_or_wait_and_raise_nothing_else(data):
    with suppress(TapeError):
        Decoder().feed(data)


@pytest.mark.parametrize("longest", [0, 1, 1000])
def test_a_body_as_long_as_allowed_is_heard_and_a_longer_one_refused_by_its_head_alone(longest):
    body = bytes(longest)
    assert Decoder(longest).feed(encode(Entry(Kind.EVENT, 1.0, body))) == [Entry(Kind.EVENT, 1.0, body)]
    with pytest.raises(TapeError, match=f"{longest + 1} bytes"):
        Decoder(longest).feed(HEAD.pack(longest + 1, Kind.EVENT, 1.0))


def test_json_that_is_none_is_refused():
    with pytest.raises(TapeError, match="EVENT"):
        _ = Entry(Kind.EVENT, 0.0, b"{").facts


def test_a_measured_sample_comes_back_whole_with_its_nans():
    raw = RawSample(65535, 12.5, Sample(1, 2, 3, 3, 4, 5, 6, 7, 8), 0.002, True, False)
    m = Measurement(t_s=12.5, pressure_kpa=8.1, force_n=-0.0, in_contact=True, quality=Quality.SENSOR)
    back = unpack(pack(raw, m))
    assert back[:13] == (65535, 1, 2, 3, 3, 4, 5, 6, 7, 8, 0.002, True, False)
    assert (back.t_s, back.pressure_kpa, back.in_contact, back.quality) == (
        12.5,
        8.1,
        True,
        Quality.SENSOR.value,
    )
    assert math.copysign(1, back.force_n) == -1
    assert math.isnan(back.rise_kpa)
    assert Measured._fields[13:] == Measurement._fields
    with pytest.raises(struct.error):
        unpack(pack(raw, m)[:-1])


def test_each_listener_gets_what_it_wants_and_no_more():
    feed = Feed()
    feed.note(Kind.BEAT, 1.0, b"\0")  # nobody listens
    recorder, page = Listener("record"), Listener("page")
    feed.listeners += [recorder, page]
    for kind in (Kind.BEAT, Kind.MEASURED, Kind.EVENT):
        feed.note(kind, 2.0)
    feed.tell(Kind.SNAPSHOT, 2.0, {"force_n": None})
    heard = [[e.kind for e in Decoder().feed(listener.take())] for listener in (recorder, page)]
    assert heard == [[Kind.BEAT, Kind.MEASURED, Kind.EVENT], [Kind.MEASURED, Kind.EVENT, Kind.SNAPSHOT]]
    assert (recorder.take(), recorder.behind) == (b"", 0)


def test_nobody_may_want_anything_else():
    with pytest.raises(KeyError):
        Listener("everything")


def test_a_listener_that_takes_nothing_costs_a_bounded_amount():
    feed, listener = Feed(), Listener("record")
    feed.listeners.append(listener)
    body = bytes(100_000)
    for _ in range(200):
        feed.note(Kind.RECEIVED, 0.0, body)
    assert MOST_BACKLOG < listener.behind < MOST_BACKLOG + 2 * len(body)


def test_what_is_told_survives_json():
    facts = {"values": {"mode": ["vent", "hold"]}, "n": 1.25}
    assert told(Kind.EVENT, 1.0, facts).facts == facts
