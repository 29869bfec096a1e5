"""One wire, two ears: the decoders in C and in Python hear the same in any stream."""

import json
import random

import pytest

from instrument.rig.frames import KINDS, SYNC, Command, Decoder, Frame, Identify, Vent, encode
from tests.firmware.compiled import decode_in_c
from tests.firmware.vectors import VECTORS, render
from tests.tools import needs

pytestmark = needs("gcc")

STREAMS = 20_000
CASES = json.loads(VECTORS.read_text(encoding="utf-8"))


def hear_in_python(stream):
    """Frames in a stream, and how many candidates were refused and how many bytes skipped."""
    decoder = Decoder.of_host()
    return decoder.feed(stream), decoder.refused, decoder.skipped_bytes


def hear_in_c(stream):
    found, refused, skipped_bytes = decode_in_c(stream)
    return [as_frame(found_frame) for found_frame in found], refused, skipped_bytes


def as_frame(data):
    message_type = KINDS[data[2]]
    values = message_type.layout.unpack(data[6:22])
    return Frame(int.from_bytes(data[4:6], "little"), message_type(*values), data[3])


each_ear = pytest.mark.parametrize("hear", [hear_in_python, hear_in_c])


def test_the_committed_vectors_are_those_of_the_frames():
    assert VECTORS.read_text(encoding="utf-8") == render()


@each_ear
@pytest.mark.parametrize("case", CASES, ids=[case["name"] for case in CASES])
def test_each_ear_hears_the_frames_of_each_vector(hear, case):
    frames, _, _ = hear(bytes.fromhex(case["stream"]))
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
    """Flipped bits, lost and doubled bytes, starts where none belong: mostly none or one, at times many."""
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


def hear_the_same(streams, seed):
    """Compare both ears on random streams; frames heard in all."""
    draw, heard = random.Random(seed), 0
    for _ in range(streams):
        stream = a_stream(draw)
        in_c = hear_in_c(stream)
        assert in_c == hear_in_python(stream), stream.hex()
        heard += len(in_c[0])
    return heard


def test_both_ears_hear_the_same_in_random_and_damaged_streams():
    assert hear_the_same(STREAMS, seed=1) > STREAMS / 2


@pytest.mark.slow
def test_both_ears_hear_the_same_in_a_million_streams():
    assert hear_the_same(1_000_000, seed=2) > 500_000
