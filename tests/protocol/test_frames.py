"""The frames of the rig link: exact bytes, and no damage that passes for a frame."""

import itertools
import random
from binascii import crc_hqx

import pytest
from hypothesis import given
from hypothesis import strategies as st

from instrument.rig.frames import (
    FRAME_BYTES,
    KINDS,
    PROTOCOL_VERSION,
    SYNC,
    Command,
    Decoder,
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


def ear():
    return Decoder(tuple(KINDS.values()))


@each_kind
def test_every_message_survives_the_wire(message_type):
    message = message_of(message_type)
    (frame,) = ear().feed(encode(message, 0x1234))
    assert (frame.message, frame.sequence, frame.version) == (message, 0x1234, PROTOCOL_VERSION)


@each_kind
def test_every_frame_has_the_same_length(message_type):
    assert len(encode(message_of(message_type), 0)) == FRAME_BYTES


def test_a_sample_is_these_bytes_for_ever():
    assert encode(SAMPLE, 7).hex() == "a55a3301070040420f0028238813030400000011401f" + "78af"


def test_the_crc_is_the_catalogued_one():
    assert crc_hqx(b"123456789", 0xFFFF) == 0x29B1  # CRC-16/IBM-3740


def test_kinds_are_four_bits_apart():
    assert all((a ^ b).bit_count() >= 4 for a, b in itertools.combinations(KINDS, 2))


def test_the_board_is_deaf_to_boards_and_the_host_to_hosts():
    assert Decoder.of_board().feed(encode(Vent(), 1)) == []
    assert Decoder.of_host().feed(encode(SAMPLE, 1)) == []


@given(st.lists(st.sampled_from([SAMPLE, Vent(), Identify()]), max_size=8), st.data())
def test_any_chopping_of_the_stream_gives_the_same_frames(messages, data):
    stream = b"".join(encode(m, i) for i, m in enumerate(messages))
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=10)))
    decoder = ear()
    pieces = [stream[a:b] for a, b in itertools.pairwise([0, *cuts, len(stream)])]
    frames = [frame for piece in pieces for frame in decoder.feed(piece)]
    assert [f.message for f in frames] == messages


@given(st.binary(max_size=400))
def test_no_bytes_raise_and_what_is_kept_is_less_than_a_frame(noise):
    decoder = ear()
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
        assert ear().feed(flip(good, pair)) == []
    draw = random.Random(3)
    for _ in range(100_000):
        assert ear().feed(flip(good, draw.sample(bits, 3))) == []


def test_no_frame_with_a_burst_of_up_to_sixteen_bits_is_accepted():
    good, draw = encode(SAMPLE, 7), random.Random(4)
    for start in range(FRAME_BYTES * 8 - 16):
        for _ in range(50):
            inner = [start + i for i in range(1, 16) if draw.random() < 0.5]
            assert ear().feed(flip(good, [start, *inner])) == []


@pytest.mark.parametrize("damage", ["drop", "double", "insert"])
def test_a_dropped_doubled_or_inserted_byte_costs_its_frame_only(damage):
    stream = [encode(SAMPLE, i) for i in range(5)]
    for position in range(FRAME_BYTES):
        hurt = bytearray(stream[2])
        if damage == "drop":
            del hurt[position]
        else:
            hurt.insert(position, hurt[position] if damage == "double" else 0xA5)
        frames = ear().feed(b"".join([*stream[:2], bytes(hurt), *stream[3:]]))
        survivors = [f.sequence for f in frames]
        assert [s for s in survivors if s != 2] == [0, 1, 3, 4]


def test_a_start_inside_a_damaged_frame_is_found():
    good = encode(SAMPLE, 9)
    assert [f.sequence for f in ear().feed(SYNC + good[:10] + good)] == [9]


def test_only_greetings_of_another_version_are_heard():
    hello = Hello(2, 0x100, 1000, 1, 250, 2000)
    assert [f.version for f in Decoder.of_board().feed(encode(hello, 1, version=9))] == [9]
    assert Decoder.of_board().feed(encode(SAMPLE, 1, version=9)) == []
    assert Decoder.of_host().feed(encode(Command(), 1, version=9)) == []
