"""Frames of Modbus TCP, split and joined at will."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from registers.modbus.mbap import Decoder, Request, frame

requests = st.lists(
    st.builds(Request, st.integers(0, 65535), st.integers(0, 255), st.binary(min_size=1, max_size=253)),
    max_size=8,
)


def chunks(data, cuts):
    edges = [0, *sorted(cut % (len(data) + 1) for cut in cuts), len(data)]
    return [data[a:b] for a, b in pairwise(edges)]


@given(requests, st.lists(st.integers(0, 4000), max_size=30))
def test_any_split_and_concatenation_gives_the_same_requests(sent, cuts):
    decoder = Decoder()
    stream = b"".join(frame(*request) for request in sent)
    assert [r for chunk in chunks(stream, cuts) for r in decoder.feed(chunk)] == sent
    assert not decoder.broken
    assert not decoder.unfinished


@given(requests, st.binary(max_size=300), st.lists(st.integers(0, 4000), max_size=30))
def test_garbage_behind_requests_gives_the_same_however_split(sent, garbage, cuts):
    stream = b"".join(frame(*request) for request in sent) + garbage
    whole, split = Decoder(), Decoder()
    expected = whole.feed(stream)
    assert expected[: len(sent)] == sent
    assert [r for chunk in chunks(stream, cuts) for r in split.feed(chunk)] == expected
    assert split.broken == whole.broken


@pytest.mark.parametrize(
    ("data", "why"),
    [
        (b"GET / HTTP/1.1\r\n\r\n", "protocol identifier 5420h"),
        (bytes.fromhex("16030100a5010000"), "protocol identifier 0100h"),  # TLS hello
        (bytes.fromhex("00010001"), "protocol identifier 0001h"),  # told before the header is complete
        (bytes.fromhex("000100000000"), "length 0"),
        (bytes.fromhex("000100000001 01"), "length 1"),
        (bytes.fromhex("0001000000ff 01"), "length 255"),
        (bytes.fromhex("00010000ffff 01"), "length 65535"),
    ],
)
def test_what_is_no_header_breaks_the_connection(data, why):
    decoder = Decoder()
    assert decoder.feed(frame(7, 1, b"\x03") + data) == [Request(7, 1, b"\x03")], "what came before counts"
    assert decoder.broken == why
    assert decoder.feed(frame(8, 1, b"\x03")) == [], "nothing behind it does"
    assert not decoder.unfinished


def test_the_longest_frame_is_taken():
    assert Decoder().feed(frame(1, 1, bytes(253))) == [Request(1, 1, bytes(253))]


def test_an_unfinished_frame_is_known():
    decoder = Decoder()
    decoder.feed(frame(1, 1, b"\x03\0\0\0\1")[:-1])
    assert decoder.unfinished
