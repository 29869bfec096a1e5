"""Tests of the RTU decoder: frames are found by silence and CRC among other bytes."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuforce.registers.modbus.rtu import MAX_FRAME_BYTES, RtuDecoder, RtuTiming, crc, encode_frame
from tests.registers.modbus.rtu_lines import READ, READ_ANSWER, TIMING

SILENCE_S = TIMING.silence_s
ADAPTER_DELAY_S = 0.016  # delay of a USB adapter
OTHER_UNIT_FRAME = encode_frame(2, bytes.fromhex("03 04 00000000"))

pdus = st.builds(
    lambda function, data: bytes((function,)) + data, st.integers(1, 255), st.binary(max_size=252)
)
frames = st.builds(encode_frame, st.integers(0, 255), pdus)


def decode(*pieces, timing=TIMING):
    """Return the frames decoded from bytes and pauses. A silence is added at the end."""
    decoder, now_s, found = RtuDecoder(timing), 0.0, []
    for piece in (*pieces, timing.silence_s):
        if isinstance(piece, bytes):
            decoder.feed(piece, now_s)
        else:
            now_s += piece
            found += decoder.frames() if piece >= timing.silence_s else []
    return found


def join_with_pauses(pieces, pause_s):
    return [part for piece in pieces for part in (piece, pause_s)]


def chunks(data, cuts):
    edges = sorted({0, len(data), *(cut % (len(data) + 1) for cut in cuts)})
    return [data[a:b] for a, b in pairwise(edges)]


def test_the_crc_equals_the_example_of_the_specification():
    assert encode_frame(2, b"\x07") == bytes.fromhex("0207 4112")  # MODBUS over Serial Line, 6.2.2


@given(frames)
def test_the_crc_over_a_complete_frame_is_0(sent):
    assert crc(sent) == 0


@pytest.mark.parametrize(
    ("baud", "silence_ms"), [(1200, 32.08), (9600, 4.01), (19200, 2.005), (38400, 1.75), (115200, 1.75)]
)
def test_the_silence_is_three_and_a_half_characters_and_fixed_above_19200_baud(baud, silence_ms):
    assert 1e3 * RtuTiming(baud).silence_s == pytest.approx(silence_ms, abs=0.005)


@given(frames, st.lists(st.integers(0, 300), max_size=8), st.floats(0, 0.99))
def test_a_frame_in_any_pieces_with_pauses_below_the_silence_is_one_frame(sent, cuts, part):
    assert decode(*join_with_pauses(chunks(sent, cuts), part * SILENCE_S)) == [sent]


@given(frames, st.integers(1, 254))
def test_an_adapter_delay_within_a_frame_does_not_lose_the_frame(sent, cut):
    at = cut % len(sent)
    if crc(sent[:at]) or at < 4:  # otherwise the first part is itself a complete frame
        assert decode(sent[:at], ADAPTER_DELAY_S, sent[at:]) == [sent]


def test_a_uart_that_delivers_14_bytes_at_a_time_loses_no_frame_at_any_rate():
    sent = encode_frame(1, bytes.fromhex("10 0200 007b f6") + bytes(246))
    pieces = [sent[at : at + 14] for at in range(0, len(sent), 14)]
    for baud in (1200, 9600, 19200, 115200):
        timing = RtuTiming(baud)
        assert decode(*join_with_pauses(pieces, 14 * timing.character_s), timing=timing) == [sent]


def test_a_silence_is_detected_from_the_times_without_a_call_of_frames():
    for first, expected in ((b"\x55" * 9, [READ]), (OTHER_UNIT_FRAME, [OTHER_UNIT_FRAME, READ])):
        decoder = RtuDecoder(TIMING)
        decoder.feed(first, 0.0)
        decoder.feed(READ, SILENCE_S)
        assert decoder.frames() == expected


def test_garbage_before_a_frame_is_counted():
    decoder = RtuDecoder(TIMING)
    decoder.feed(b"\x55" * 9, 0.0)
    decoder.feed(READ, SILENCE_S)
    decoder.frames()
    assert decoder.lost_bytes == 9


@given(st.lists(frames, min_size=1, max_size=4))
def test_joined_frames_are_separated(sent):
    assert decode(b"".join(sent)) == sent


@given(st.lists(st.tuples(st.binary(min_size=1, max_size=40), st.floats(0, 0.2)), max_size=60))
def test_after_any_bytes_the_frame_after_a_silence_is_found(noise):
    pieces = [piece for pair in noise for piece in pair]
    assert decode(*pieces, SILENCE_S, READ)[-1] == READ


@given(st.binary(min_size=1, max_size=600))
def test_garbage_does_not_hide_a_frame_after_a_silence(garbage):
    assert decode(garbage, SILENCE_S, READ, SILENCE_S, OTHER_UNIT_FRAME)[-2:] == [READ, OTHER_UNIT_FRAME]


@given(frames, st.data())
def test_a_truncated_frame_does_not_hide_another_frame(sent, data):
    cut = data.draw(st.integers(1, len(sent) - 1))
    assert decode(sent[:cut], SILENCE_S, READ)[-1] == READ


@given(frames, st.integers(0, 2**11 - 1), st.integers(1, 255))
def test_a_frame_with_a_changed_byte_is_rejected(sent, at, change):
    damaged = bytearray(sent)
    damaged[at % len(sent)] ^= change
    assert bytes(damaged) not in decode(bytes(damaged))


def containing(request):
    """Return an answer of another unit whose registers contain `request`, a frame for this unit."""
    return encode_frame(2, bytes((3, len(request))) + request)


@pytest.mark.parametrize("answer", [containing(READ), containing(READ * 5), encode_frame(2, b"\x41" + READ)])
def test_a_frame_within_an_answer_of_another_unit_is_ignored(answer):
    request = encode_frame(2, bytes.fromhex("03 0000 0004"))
    assert decode(answer) == [answer]
    assert decode(request, SILENCE_S, answer, SILENCE_S, READ) == [request, answer, READ]
    assert decode(request + answer) == [request, answer]
    for at in range(1, len(answer)):
        assert READ not in decode(answer[:at], ADAPTER_DELAY_S, answer[at:])


@pytest.mark.parametrize(
    "data", [READ[:-1] + b"\0", b"\xff" + READ, READ + b"\xff", READ[1:], b"\x01\x04", b""]
)
def test_bytes_that_are_not_complete_frames_are_rejected(data):
    assert decode(data) == []


def test_a_frame_is_at_most_256_bytes():
    longest = encode_frame(1, b"\x41" + bytes(range(252)))
    assert len(longest) == MAX_FRAME_BYTES
    assert decode(longest) == [longest]
    assert decode(encode_frame(1, b"\x41" + bytes(range(253)))) == []


def test_an_incomplete_frame_is_dropped_after_the_longest_pause():
    assert decode(READ[:5], TIMING.max_pause_s + 0.001, READ[5:]) == []


def test_endless_bytes_without_a_pause_need_limited_memory():
    decoder = RtuDecoder(TIMING)
    for _ in range(1000):
        decoder.feed(b"\x55" * 256, 0.0)
        assert len(decoder._data) <= 1024
    assert decoder.frames() == []
    decoder.feed(READ, SILENCE_S)
    assert decoder.frames() == [READ]
    assert decoder.lost_bytes == 256_000


def test_single_bytes_between_silences_need_limited_memory():
    decoder = RtuDecoder(TIMING)
    for count in range(2000):
        decoder.feed(b"\x55", count * SILENCE_S)
        assert decoder.frames() == []
    assert len(decoder._starts) <= 32
    decoder.feed(READ_ANSWER, 2000 * SILENCE_S)
    assert decoder.frames() == [READ_ANSWER]
