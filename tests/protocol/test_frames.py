"""Tests of the frames of the rig link: exact bytes, and rejection of damaged frames."""

import itertools
import random
from binascii import crc_hqx

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuforce.protocol.frames import (
    FRAME_BYTES,
    KINDS,
    PROTOCOL_VERSION,
    SYNC,
    Command,
    FrameDecoder,
    Hello,
    Identify,
    Sample,
    Vent,
    encode,
)

SAMPLE = Sample(1_000_000, 9_000, 5_000, 3, 4, 0, 0, 17, 8_000)
each_kind = pytest.mark.parametrize("message_type", KINDS.values(), ids=lambda m: m.__name__)


def message_of(message_type):
    values = message_type.layout.unpack(bytes(range(1, message_type.layout.size + 1)))
    return message_type(*values)


def decoder_of_all_kinds():
    return FrameDecoder(tuple(KINDS.values()))


@each_kind
def test_every_message_is_decoded_as_encoded(message_type):
    message = message_of(message_type)
    (frame,) = decoder_of_all_kinds().feed(encode(message, 0x1234))
    assert (frame.message, frame.sequence, frame.version) == (message, 0x1234, PROTOCOL_VERSION)


@each_kind
def test_every_frame_has_the_same_length(message_type):
    assert len(encode(message_of(message_type), 0)) == FRAME_BYTES


def test_the_bytes_of_a_sample_never_change():
    assert encode(SAMPLE, 7).hex() == "a55a3301070040420f0028238813030400000011401f" + "78af"


def test_the_crc_is_crc_16_ibm_3740():
    assert crc_hqx(b"123456789", 0xFFFF) == 0x29B1


def test_any_two_kinds_differ_in_at_least_four_bits():
    assert all((a ^ b).bit_count() >= 4 for a, b in itertools.combinations(KINDS, 2))


def test_a_decoder_rejects_the_frames_that_its_own_side_sends():
    assert FrameDecoder.for_board_frames().feed(encode(Vent(), 1)) == []
    assert FrameDecoder.for_host_frames().feed(encode(SAMPLE, 1)) == []


@given(st.lists(st.sampled_from([SAMPLE, Vent(), Identify()]), max_size=8), st.data())
def test_a_stream_in_arbitrary_pieces_gives_the_same_frames(messages, data):
    stream = b"".join(encode(m, i) for i, m in enumerate(messages))
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=10)))
    decoder = decoder_of_all_kinds()
    pieces = [stream[a:b] for a, b in itertools.pairwise([0, *cuts, len(stream)])]
    frames = [frame for piece in pieces for frame in decoder.feed(piece)]
    assert [f.message for f in frames] == messages


@given(st.binary(max_size=400))
def test_random_bytes_raise_no_exception_and_the_decoder_buffers_less_than_a_frame(noise):
    decoder = decoder_of_all_kinds()
    decoder.feed(noise)
    assert len(decoder._buffer) < FRAME_BYTES


def flip(data, bits):
    damaged = bytearray(data)
    for bit in bits:
        damaged[bit // 8] ^= 1 << bit % 8
    return bytes(damaged)


def test_no_frame_with_up_to_three_flipped_bits_is_accepted():
    good = encode(SAMPLE, 7)
    bits = range(FRAME_BYTES * 8)
    for pair in itertools.chain(itertools.combinations(bits, 1), itertools.combinations(bits, 2)):
        assert decoder_of_all_kinds().feed(flip(good, pair)) == []
    draw = random.Random(3)
    for _ in range(100_000):
        assert decoder_of_all_kinds().feed(flip(good, draw.sample(bits, 3))) == []


def test_no_frame_with_a_burst_of_up_to_sixteen_bits_is_accepted():
    good, draw = encode(SAMPLE, 7), random.Random(4)
    for start in range(FRAME_BYTES * 8 - 16):
        for _ in range(50):
            inner = [start + i for i in range(1, 16) if draw.random() < 0.5]
            assert decoder_of_all_kinds().feed(flip(good, [start, *inner])) == []


@pytest.mark.parametrize("damage", ["drop", "double", "insert"])
def test_a_dropped_doubled_or_inserted_byte_loses_only_its_frame(damage):
    stream = [encode(SAMPLE, i) for i in range(5)]
    for position in range(FRAME_BYTES):
        damaged = bytearray(stream[2])
        if damage == "drop":
            del damaged[position]
        else:
            damaged.insert(position, damaged[position] if damage == "double" else 0xA5)
        frames = decoder_of_all_kinds().feed(b"".join([*stream[:2], bytes(damaged), *stream[3:]]))
        survivors = [f.sequence for f in frames]
        assert [s for s in survivors if s != 2] == [0, 1, 3, 4]


def test_a_start_inside_a_damaged_frame_is_found():
    good = encode(SAMPLE, 9)
    assert [f.sequence for f in decoder_of_all_kinds().feed(SYNC + good[:10] + good)] == [9]


def test_only_hello_and_identify_are_accepted_with_another_version():
    hello = Hello(2, 0x100, 1000, 1, 250, 2000)
    assert [f.version for f in FrameDecoder.for_board_frames().feed(encode(hello, 1, version=9))] == [9]
    assert FrameDecoder.for_board_frames().feed(encode(SAMPLE, 1, version=9)) == []
    assert FrameDecoder.for_host_frames().feed(encode(Command(), 1, version=9)) == []
