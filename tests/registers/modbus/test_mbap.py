"""Tests of the MBAP decoder with frames that are split and joined at any position."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuforce.registers.modbus.mbap import MbapDecoder, MbapRequest, encode_frame

requests = st.lists(
    st.builds(MbapRequest, st.integers(0, 65535), st.integers(0, 255), st.binary(min_size=1, max_size=253)),
    max_size=8,
)


def chunks(data, cuts):
    edges = [0, *sorted(cut % (len(data) + 1) for cut in cuts), len(data)]
    return [data[a:b] for a, b in pairwise(edges)]


@given(requests, st.lists(st.integers(0, 4000), max_size=30))
def test_any_split_and_concatenation_gives_the_same_requests(sent, cuts):
    decoder = MbapDecoder()
    stream = b"".join(encode_frame(*request) for request in sent)
    assert [r for chunk in chunks(stream, cuts) for r in decoder.feed(chunk)] == sent
    assert not decoder.error
    assert not decoder.is_incomplete


@given(requests, st.binary(max_size=300), st.lists(st.integers(0, 4000), max_size=30))
def test_garbage_after_requests_gives_the_same_result_for_any_split(sent, garbage, cuts):
    stream = b"".join(encode_frame(*request) for request in sent) + garbage
    unsplit, split = MbapDecoder(), MbapDecoder()
    expected = unsplit.feed(stream)
    assert expected[: len(sent)] == sent
    assert [r for chunk in chunks(stream, cuts) for r in split.feed(chunk)] == expected
    assert split.error == unsplit.error


@pytest.mark.parametrize(
    ("data", "error"),
    [
        (b"GET / HTTP/1.1\r\n\r\n", "protocol identifier 5420h"),
        (bytes.fromhex("16030100a5010000"), "protocol identifier 0100h"),  # TLS hello
        (bytes.fromhex("00010001"), "protocol identifier 0001h"),  # detected before the header is complete
        (bytes.fromhex("000100000000"), "length 0"),
        (bytes.fromhex("000100000001 01"), "length 1"),
        (bytes.fromhex("0001000000ff 01"), "length 255"),
        (bytes.fromhex("00010000ffff 01"), "length 65535"),
    ],
)
def test_an_invalid_header_is_an_error(data, error):
    decoder = MbapDecoder()
    assert decoder.feed(encode_frame(7, 1, b"\x03") + data) == [MbapRequest(7, 1, b"\x03")], (
        "requests before the error are valid"
    )
    assert decoder.error == error
    assert decoder.feed(encode_frame(8, 1, b"\x03")) == [], "bytes after the error are ignored"
    assert not decoder.is_incomplete


def test_the_longest_frame_is_accepted():
    assert MbapDecoder().feed(encode_frame(1, 1, bytes(253))) == [MbapRequest(1, 1, bytes(253))]


def test_an_incomplete_frame_is_detected():
    decoder = MbapDecoder()
    decoder.feed(encode_frame(1, 1, b"\x03\0\0\0\1")[:-1])
    assert decoder.is_incomplete
