"""Tests of the line noise, and of the decoding of frames from a noisy line."""

import random

import pytest

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.rig.link import Link, LinkPhase
from pneuforce.protocol.frames import BoardKind, FrameDecoder, Hello, Image, Sample, encode
from pneuforce.sim.line.line_noise import LineNoise, NoisyLine

TEXT = random.Random(7).randbytes(20_000)


def transferred(data=TEXT, seed=1, **noise):
    line = NoisyLine(LineNoise(**noise), seed)
    line.send(data, 0.0)
    return line.receive(1e9)


def count_different_bits(a, b):
    return sum((x ^ y).bit_count() for x, y in zip(a, b, strict=True))


def test_a_clean_line_transfers_every_byte_at_once():
    assert transferred() == TEXT


def test_the_same_seed_gives_the_same_disturbance_and_another_seed_does_not():
    noise = {"flipped_bits": 1e-3, "dropped": 1e-2, "inserted": 1e-2}
    assert transferred(**noise) == transferred(**noise)
    assert transferred(**noise) != transferred(seed=2, **noise)


def test_bits_are_flipped_at_the_configured_rate():
    assert count_different_bits(TEXT, transferred(flipped_bits=0.01)) == pytest.approx(
        0.01 * 8 * len(TEXT), rel=0.1
    )


@pytest.mark.parametrize(
    ("noise", "share"), [({"dropped": 0.05}, -0.05), ({"doubled": 0.05}, 0.05), ({"inserted": 0.05}, 0.05)]
)
def test_bytes_are_dropped_doubled_and_inserted_at_their_rates(noise, share):
    assert (len(transferred(**noise)) - len(TEXT)) / len(TEXT) == pytest.approx(share, rel=0.15)


def test_a_doubled_byte_arrives_twice_in_a_row():
    assert transferred(b"abc", doubled=1.0) == b"aabbcc"


def test_a_burst_disturbs_at_most_16_bits_in_a_row():
    lengths = set()
    for seed in range(400):
        line = NoisyLine(LineNoise(bursts=1.0), seed)
        line.send(bytes(1), 0.0)
        line.noise.bursts = 1e-12  # one burst only
        line.send(bytes(7), 0.0)
        lengths.add(len(f"{int.from_bytes(line.receive(0.0), 'big'):064b}".strip("0")))
    assert min(lengths) >= 1
    assert 12 < max(lengths) <= 16


def test_a_byte_arrives_after_the_delay():
    line = NoisyLine(LineNoise(delay_s=0.05))
    line.send(b"one", 10.0)
    line.send(b"two", 10.02)
    assert line.receive(10.049) == b""
    assert line.receive(10.05) == b"one"
    assert line.receive(10.1) == b"two"
    assert not line.in_transit


def test_all_bytes_of_a_stalled_line_arrive_in_order_after_the_stall():
    line = NoisyLine(LineNoise(stalled=True))
    line.send(b"one", 0.0)
    line.send(b"two", 1.0)
    assert line.receive(5.0) == b""
    line.noise.stalled = False
    assert line.receive(5.0) == b"onetwo"


def test_a_cut_line_loses_the_bytes_that_are_sent_or_in_transit():
    line = NoisyLine(LineNoise(delay_s=1.0))
    line.send(b"one", 0.0)
    line.noise.cut = True
    assert line.receive(2.0) == b""
    line.send(b"two", 2.0)
    line.noise.cut = False
    line.send(b"three", 3.0)
    assert line.receive(9.0) == b"three"


def test_bytes_arrive_in_pieces_of_the_configured_length():
    line = NoisyLine(LineNoise(max_chunk_bytes=3))
    line.send(b"abcd", 0.0)
    line.send(b"efgh", 0.0)
    assert [line.receive(0.0) for _ in range(4)] == [b"abc", b"def", b"gh", b""]


# frames of the rig link through a noisy line

NOISES = {
    "flipped bits": {"flipped_bits": 3e-4},
    "bursts": {"bursts": 2e-3},
    "dropped bytes": {"dropped": 2e-3},
    "doubled bytes": {"doubled": 2e-3},
    "inserted bytes": {"inserted": 2e-3},
    "all at once": {"flipped_bits": 1e-4, "bursts": 1e-3, "dropped": 1e-3, "doubled": 1e-3, "inserted": 1e-3},
}


def sample(sequence):
    return Sample(sequence * 2000, 1000 + sequence % 9000, 5000, 2, 4, 0, 0, sequence & 0xFF, 8000)


@pytest.mark.parametrize("noise", NOISES.values(), ids=NOISES)
def test_damaged_frames_are_rejected_and_a_disturbance_loses_at_most_one_more_frame(noise):
    line, decoder = NoisyLine(LineNoise(**noise), seed=3), FrameDecoder.for_board_frames()
    accepted, disturbed = [], 0
    for sequence in range(20_000):
        sent = encode(sample(sequence), sequence)
        line.send(sent, 0.0)
        arrived = line.receive(0.0)
        disturbed += arrived != sent
        accepted += decoder.feed(arrived)
    assert all(f.message == sample(f.sequence) for f in accepted)
    lost = 20_000 - len(accepted)
    assert disturbed > 100
    assert lost <= 2 * disturbed
    assert decoder.skipped_bytes > 0


def test_the_link_counts_lost_frames_and_recovers_as_soon_as_the_line_is_clean():
    link, line, received = Link(), NoisyLine(LineNoise()), 0
    link.feed(encode(Image(0x12345678), 0), 0.0)
    link.feed(encode(Hello(BoardKind.SIMULATED, 0x100, 1000, 1, 250, 2000), 0), 0.0)
    for sequence in range(1, 3001):
        line.noise.flipped_bits = 2e-3 if 1000 <= sequence < 2000 else 0.0
        line.send(encode(sample(sequence), sequence), sequence * 2e-3)
        samples = link.feed(line.receive(sequence * 2e-3), sequence * 2e-3)
        assert all(s.message == sample(s.sequence) for s in samples)
        received += len(samples)
        if sequence > 2001:
            assert len(samples) == 1
    assert received + link.lost_frames == 3000
    assert 200 < link.lost_frames < 500
    assert link.phase is LinkPhase.READY


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("delay_s", -1),
        ("delay_s", "0.1"),
        ("flipped_bits", 1.1),
        ("dropped", float("nan")),
        ("dropped", None),
        ("max_chunk_bytes", 1.5),
        ("stalled", 2),
    ],
)
def test_an_impossible_disturbance_is_rejected_and_changes_nothing(name, value):
    noise = LineNoise()
    with pytest.raises(ConfigurationError, match=f"{name} = .* must be 0 "):
        setattr(noise, name, value)
    assert noise == LineNoise()
