"""Tests of the decoders in C and in Python: both decode the same frames from any stream."""

import json
import random

import pytest

from pneuforce.protocol.frames import KINDS, SYNC, Command, Frame, FrameDecoder, Identify, Vent, encode
from tests.firmware.compiled import decode_in_c
from tests.firmware.vectors import VECTORS, render
from tests.tools import needs

pytestmark = needs("gcc")

STREAMS = 20_000
CASES = json.loads(VECTORS.read_text(encoding="utf-8"))


def decode_by_python(stream):
    """Return the frames in a stream, and the numbers of rejected frames and skipped bytes."""
    decoder = FrameDecoder.for_host_frames()
    return decoder.feed(stream), decoder.rejected_frames, decoder.skipped_bytes


def decode_by_c(stream):
    found, rejected, skipped_bytes = decode_in_c(stream)
    return [as_frame(found_frame) for found_frame in found], rejected, skipped_bytes


def as_frame(data):
    message_type = KINDS[data[2]]
    values = message_type.layout.unpack(data[6:22])
    return Frame(int.from_bytes(data[4:6], "little"), message_type(*values), data[3])


each_decoder = pytest.mark.parametrize("decode", [decode_by_python, decode_by_c])


def test_the_committed_vectors_are_the_generated_vectors():
    assert VECTORS.read_text(encoding="utf-8") == render()


@each_decoder
@pytest.mark.parametrize("case", CASES, ids=[case["name"] for case in CASES])
def test_each_decoder_returns_the_frames_of_each_vector(decode, case):
    frames, _, _ = decode(bytes.fromhex(case["stream"]))
    assert [encode(f.message, f.sequence, f.version).hex() for f in frames] == case["frames"]


def a_frame(draw):
    message = draw.choice(
        [
            Vent(),
            Identify(),
            Command(draw.randrange(3), draw.randrange(256), draw.randrange(65536), draw.randrange(-999, 999)),
        ]
    )
    return encode(message, draw.randrange(65536), draw.choice([1, 1, 1, 1, 2]))


def damaged(draw, stream):
    """Return the stream with random errors. Most streams get no error or one error.

    An error is a flipped bit, a lost byte, a doubled byte or a false start of a frame.
    """
    stream = bytearray(stream)
    for _ in range(min(draw.choice([0, 0, 1, 1, 2, 10]), len(stream))):
        position = draw.randrange(len(stream))
        match draw.randrange(4):
            case 0:
                stream[position] ^= 1 << draw.randrange(8)
            case 1:
                del stream[position]
            case 2:
                stream.insert(position, stream[position])
            case 3:
                stream[position:position] = SYNC[: draw.randrange(1, 3)]
    return bytes(stream)


def a_stream(draw):
    pieces = [
        draw.choice([a_frame(draw), a_frame(draw), draw.randbytes(draw.randrange(40)), SYNC])
        for _ in range(draw.randrange(1, 6))
    ]
    return damaged(draw, b"".join(pieces))


def compare_decoders(streams, seed):
    """Compare both decoders on random streams. Return the number of decoded frames."""
    draw, decoded = random.Random(seed), 0
    for _ in range(streams):
        stream = a_stream(draw)
        in_c = decode_by_c(stream)
        assert in_c == decode_by_python(stream), stream.hex()
        decoded += len(in_c[0])
    return decoded


def test_both_decoders_agree_on_random_and_damaged_streams():
    assert compare_decoders(STREAMS, seed=1) > STREAMS / 2


@pytest.mark.slow
def test_both_decoders_agree_on_a_million_streams():
    assert compare_decoders(1_000_000, seed=2) > 500_000
