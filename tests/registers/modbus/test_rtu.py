"""Frames of a serial line: by silence and CRC, whatever else is on it."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from registers.modbus.rtu import LONGEST, Decoder, Timing, crc, frame
from tests.registers.modbus.rtu_lines import READ, READ_ANSWER, TIMING

SILENCE_S = TIMING.silence_s
HICCUP_S = 0.016  # of a USB adapter
FOREIGN = frame(2, bytes.fromhex("03 04 00000000"))

pdus = st.builds(
    lambda function, data: bytes((function,)) + data, st.integers(1, 255), st.binary(max_size=252)
)
whole = st.builds(frame, st.integers(0, 255), pdus)


def heard(*pieces, timing=TIMING):
    """Frames that come out of bytes and pauses, with a silence at the end."""
    decoder, now_s, found = Decoder(timing), 0.0, []
    for piece in (*pieces, timing.silence_s):
        if isinstance(piece, bytes):
            decoder.feed(piece, now_s)
        else:
            now_s += piece
            found += decoder.frames() if piece >= timing.silence_s else []
    return found


def with_pauses(pieces, pause_s):
    return [part for piece in pieces for part in (piece, pause_s)]


def chunks(data, cuts):
    edges = sorted({0, len(data), *(cut % (len(data) + 1) for cut in cuts)})
    return [data[a:b] for a, b in pairwise(edges)]


def test_the_crc_is_the_specifications():
    assert frame(2, b"\x07") == bytes.fromhex("0207 4112")  # its example, 6.2.2


@given(whole)
def test_the_crc_over_a_whole_frame_is_0(sent):
    assert crc(sent) == 0


@pytest.mark.parametrize(
    ("baud", "silence_ms"), [(1200, 32.08), (9600, 4.01), (19200, 2.005), (38400, 1.75), (115200, 1.75)]
)
def test_the_silence_is_three_and_a_half_characters_and_fixed_above_19200_baud(baud, silence_ms):
    assert 1e3 * Timing(baud).silence_s == pytest.approx(silence_ms, abs=0.005)


@given(whole, st.lists(st.integers(0, 300), max_size=8), st.floats(0, 0.99))
def test_a_frame_in_any_pieces_with_pauses_below_the_silence_is_one_frame(sent, cuts, part):
    assert heard(*with_pauses(chunks(sent, cuts), part * SILENCE_S)) == [sent]


@given(whole, st.integers(1, 254))
def test_an_adapter_that_hiccups_within_a_frame_does_not_cost_it(sent, cut):
    at = cut % len(sent)
    if crc(sent[:at]) or at < 4:  # else what has come is a frame already
        assert heard(sent[:at], HICCUP_S, sent[at:]) == [sent]


def test_a_uart_that_hands_over_14_bytes_at_a_time_does_not_cost_a_frame_at_any_rate():
    sent = frame(1, bytes.fromhex("10 0200 007b f6") + bytes(246))
    pieces = [sent[at : at + 14] for at in range(0, len(sent), 14)]
    for baud in (1200, 9600, 19200, 115200):
        timing = Timing(baud)
        assert heard(*with_pauses(pieces, 14 * timing.character_s), timing=timing) == [sent]


def test_a_silence_shows_in_the_times_though_nobody_was_told_when_it_passed():
    for first, expected in ((b"\x55" * 9, [READ]), (FOREIGN, [FOREIGN, READ])):
        decoder = Decoder(TIMING)
        decoder.feed(first, 0.0)
        decoder.feed(READ, SILENCE_S)
        assert decoder.frames() == expected


def test_garbage_in_front_of_a_frame_is_counted():
    decoder = Decoder(TIMING)
    decoder.feed(b"\x55" * 9, 0.0)
    decoder.feed(READ, SILENCE_S)
    decoder.frames()
    assert decoder.lost_bytes == 9


@given(st.lists(whole, min_size=1, max_size=4))
def test_frames_that_a_late_scheduler_has_joined_are_taken_apart(sent):
    assert heard(b"".join(sent)) == sent


@given(st.lists(st.tuples(st.binary(min_size=1, max_size=40), st.floats(0, 0.2)), max_size=60))
def test_whatever_comes_nothing_is_raised_and_the_frame_behind_a_silence_is_found(noise):
    pieces = [piece for pair in noise for piece in pair]
    assert heard(*pieces, SILENCE_S, READ)[-1] == READ


@given(st.binary(min_size=1, max_size=600))
def test_garbage_costs_no_frame_behind_a_silence(garbage):
    assert heard(garbage, SILENCE_S, READ, SILENCE_S, FOREIGN)[-2:] == [READ, FOREIGN]


@given(whole, st.data())
def test_a_frame_cut_short_costs_no_other(sent, data):
    cut = data.draw(st.integers(1, len(sent) - 1))
    assert heard(sent[:cut], SILENCE_S, READ)[-1] == READ


@given(whole, st.integers(0, 2**11 - 1), st.integers(1, 255))
def test_a_changed_byte_makes_it_no_frame(sent, at, change):
    broken = bytearray(sent)
    broken[at % len(sent)] ^= change
    assert bytes(broken) not in heard(bytes(broken))


def containing(request):
    """Another unit's answer whose registers hold a frame that is a request for us."""
    return frame(2, bytes((3, len(request))) + request)


@pytest.mark.parametrize("answer", [containing(READ), containing(READ * 5), frame(2, b"\x41" + READ)])
def test_a_frame_within_another_units_answer_is_none(answer):
    request = frame(2, bytes.fromhex("03 0000 0004"))
    assert heard(answer) == [answer]
    assert heard(request, SILENCE_S, answer, SILENCE_S, READ) == [request, answer, READ]
    assert heard(request + answer) == [request, answer]
    for at in range(1, len(answer)):
        assert READ not in heard(answer[:at], HICCUP_S, answer[at:])


@pytest.mark.parametrize(
    "data", [READ[:-1] + b"\0", b"\xff" + READ, READ + b"\xff", READ[1:], b"\x01\x04", b""]
)
def test_what_is_not_whole_frames_to_the_last_byte_is_none(data):
    assert heard(data) == []


def test_a_frame_is_at_most_256_bytes():
    longest = frame(1, b"\x41" + bytes(range(252)))
    assert len(longest) == LONGEST
    assert heard(longest) == [longest]
    assert heard(frame(1, b"\x41" + bytes(range(253)))) == []


def test_a_frame_that_stays_unfinished_is_forgotten():
    assert heard(READ[:5], TIMING.patience_s + 0.001, READ[5:]) == []


def test_babble_without_a_pause_fills_no_memory_and_a_silence_ends_it():
    decoder = Decoder(TIMING)
    for _ in range(1000):
        decoder.feed(b"\x55" * 256, 0.0)
        assert len(decoder._data) <= 1024
    assert decoder.frames() == []
    decoder.feed(READ, SILENCE_S)
    assert decoder.frames() == [READ]
    assert decoder.lost_bytes == 256_000


def test_bytes_that_drip_fill_no_memory():
    decoder = Decoder(TIMING)
    for count in range(2000):
        decoder.feed(b"\x55", count * SILENCE_S)
        assert decoder.frames() == []
    assert len(decoder._starts) <= 32
    decoder.feed(READ_ANSWER, 2000 * SILENCE_S)
    assert decoder.frames() == [READ_ANSWER]
