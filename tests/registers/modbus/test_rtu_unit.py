"""Tests of a unit that shares a serial line with other units. It handles only its own requests."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuforce.registers.modbus.rtu import encode_frame
from tests.registers.modbus.rtu_lines import HOLD, READ, READ_ANSWER, SILENCE_S, TIMING, VENT, VirtualLine

MASTER_PAUSE_S = 0.05
READ_OF_OTHER_UNIT = encode_frame(2, bytes.fromhex("04 0000 0002"))


@pytest.fixture
def line():
    return VirtualLine()


@pytest.mark.parametrize(
    ("request_", "answer"),
    [
        ("04 0000 0002", "04 04 3f a0 00 00"),
        ("03 0f00 0002", "03 04 c2 f6 e6 66"),
        ("02 0003 0001", "02 01 01"),
        ("06 0204 0001", "06 02 04 00 01"),
        ("10 0200 0002 04 41000000", "10 02 00 00 02"),
        ("16 0204 fffe 0001", "16 02 04 ff fe 00 01"),
        ("17 0f00 0001 0204 0001 02 0000", "17 02 c2 f6"),
        ("08 0000 a537", "08 00 00 a5 37"),
        ("03 0000 0000", "83 03"),
        ("03 0000 007e", "83 03"),
        ("04 0000 00", "84 03"),  # wrong length, valid CRC
        ("02 0000 07d1", "82 03"),
        ("05 0000 0001", "85 03"),
        ("10 0200 0002 03 410000", "90 03"),
        ("10 0200 0002 04 4100", "90 03"),
        ("10 0200 0002 04 41480000", "90 03"),  # 12.5 kPa
        ("03 ffff 0002", "83 02"),
        ("01 0000 0001", "81 02"),
        ("08 0001 0000", "88 01"),
        ("64", "e4 01"),
        ("41 0102030405", "c1 01"),
        ("2b 0d", "ab 01"),
        ("2b 0e 04 00", "2b 0e 04 83 00 00 01 00 09 70 6e 65 75 66 6f 72 63 65"),
    ],
)
def test_requests_are_answered_as_on_tcp(line, request_, answer):
    assert line.send_request(request_) == answer


@pytest.mark.parametrize("pdu", ["80", "83 02", "ab 01", "ff"])
def test_an_exception_response_of_another_unit_is_not_answered(line, pdu):
    assert line.send_request(pdu) == ""
    assert line.send_request("04 0000 0002")


@pytest.mark.parametrize("unit", [2, 17, 247, 248, 255])
@pytest.mark.parametrize("pdu", ["04 0000 0002", "06 0204 0000", "06 0204 0001", "64"])
def test_requests_to_other_units_are_ignored(line, unit, pdu):
    assert line.send_request(pdu, unit) == ""
    assert line.source.write_requests == []


@pytest.mark.parametrize("place", range(len(READ)))
def test_a_damaged_request_is_counted_and_not_answered_and_the_next_is_answered(line, place):
    damaged = READ[:place] + bytes((READ[place] ^ 0x10,)) + READ[place + 1 :]
    assert line.play(damaged, 0.2) == []
    assert line.play(READ) == [READ_ANSWER]
    assert line.unit.lost_bytes == len(READ)


def test_a_broadcast_vents_and_is_not_answered(line):
    line.play(encode_frame(1, HOLD))
    assert line.source.values["mode"] == "hold"
    assert line.send_request("06 0204 0000", unit=0) == ""
    assert line.source.values["mode"] == "vent"
    assert line.unit.counters.broadcasts == 1


def test_a_vent_within_a_broadcast_is_carried_out_without_the_rest(line):
    line.source.values.update(mode="hold", force_limit_n=5.0)
    assert line.send_request("10 0202 0003 06 40000000 0000", unit=0) == ""  # force limit 2 N, mode vent
    assert (line.source.values["mode"], line.source.values["force_limit_n"]) == ("vent", 5.0)


@pytest.mark.parametrize(
    "pdu",
    [
        "04 0000 0002",
        "06 0204 0001",
        "10 0200 0002 04 41000000",
        "06 0205 03e8",
        "10 0208 0004 08 5046000200000001",
        "08 0000 a537",
        "2b 0e 01 00",
        "64",
        "86 01",
    ],
)
def test_every_other_broadcast_changes_nothing_and_is_not_answered(line, pdu):
    assert line.send_request(pdu, unit=0) == ""
    assert line.source.write_requests == []
    assert line.unit.counters.broadcasts == 1


@pytest.mark.parametrize("pdu", ["06 0204 0001", "10 0202 0003 06 40000000 0000", "10", "05 0000 ff00"])
def test_a_broadcast_that_is_not_carried_out_is_not_logged_as_rejected(line, pdu, caplog):
    line.send_request(pdu, unit=0)
    assert (line.source.rejected_writes, caplog.messages) == ([], [])


def test_a_read_only_unit_still_vents():
    line = VirtualLine(read_only=True)
    assert line.send_request("06 0204 0001") == "86 01"
    assert line.send_request("06 0204 0000") == "06 02 04 00 00"
    assert line.source.write_requests == [{"mode": "vent"}]


def test_the_low_word_comes_first_if_configured():
    assert VirtualLine(word_swap=True).send_request("04 0000 0002") == "04 04 00 00 3f a0"


def test_the_peer_is_the_serial_line(line):
    peers = []
    line.source.reject = lambda peer, _values: peers.append(tuple(peer)) or "none"
    line.play(encode_frame(1, HOLD))
    assert peers == [("modbus_rtu", "")]


NOISES = {
    "garbage": b"\x00\xff\x13\x37" * 5,
    "a truncated request": READ[:5],
    "the number of this unit, and nothing else": b"\x01",
    "a request to another unit": READ_OF_OTHER_UNIT,
    "a request to another unit and its answer": READ_OF_OTHER_UNIT + encode_frame(2, READ_ANSWER[1:-2]),
    "an answer of another unit that contains a request to this unit": encode_frame(2, b"\x03\x08" + READ),
    "a truncated request to another unit": READ_OF_OTHER_UNIT[:6],
    "a wrong CRC": READ[:-1] + b"\x00",
    "an answer of another device with the same unit number": READ_ANSWER,
}


@pytest.mark.parametrize("noise", NOISES)
def test_other_bytes_do_not_hide_a_request_after_a_silence(noise):
    for pause_s in (SILENCE_S, 0.01, 0.1, 1.0):
        line = VirtualLine()
        assert line.play(NOISES[noise], pause_s, READ)[-1:] == [READ_ANSWER]


@pytest.mark.parametrize(
    "noise", sorted(set(NOISES) - {"an answer of another device with the same unit number"})
)
def test_other_bytes_are_not_answered(line, noise):
    assert line.play(NOISES[noise], 1.0) == []


def test_bytes_between_two_silences_are_a_frame_from_any_sender(line):
    """The standard separates frames by silences. A sender must not pause within a frame."""
    before, after = b"\x02\x03\x08", b"\x12\x34"
    assert line.play(before, SILENCE_S, READ, SILENCE_S, after) == [READ_ANSWER]
    assert line.play(1.0, before, READ, SILENCE_S, after) == []
    assert line.play(1.0, before, SILENCE_S, READ, after) == []


@given(st.lists(st.tuples(st.binary(max_size=300), st.floats(0, 0.2)), max_size=20))
def test_after_any_garbage_and_a_silence_a_request_is_answered(garbage):
    line = VirtualLine()
    line.play(*(piece for pair in garbage for piece in pair), SILENCE_S)
    assert line.play(READ) == [READ_ANSWER]


def test_requests_that_a_late_scheduler_has_joined_are_all_carried_out_and_the_last_is_answered(line):
    assert line.play(encode_frame(1, HOLD) + encode_frame(1, VENT) + READ) == [READ_ANSWER]
    assert line.source.write_requests == [{"mode": "hold"}, {"mode": "vent"}]


def test_a_request_followed_by_a_request_to_another_unit_is_carried_out_without_an_answer(line):
    assert line.play(encode_frame(1, VENT) + READ_OF_OTHER_UNIT) == []
    assert line.source.write_requests == [{"mode": "vent"}]


def test_a_request_after_frames_of_another_unit_is_answered_though_all_arrive_at_once(line):
    assert line.play(READ_OF_OTHER_UNIT + encode_frame(2, READ_ANSWER[1:-2]) + READ) == [READ_ANSWER]


def test_a_request_is_answered_when_the_silence_is_over_and_not_before(line):
    line.unit.feed(READ[:4], 0.0)
    line.unit.feed(READ[4:], 0.9 * SILENCE_S)
    assert line.unit.answer(1.9 * SILENCE_S) == READ_ANSWER
    assert line.unit.answer(3.0 * SILENCE_S) == b""


# ---- echo of the unit's own answers


class EchoingLine(VirtualLine):
    """Line with an echo. The unit receives its own answer completely before the next request."""

    def play(self, *pieces, spoil=lambda echo: echo):
        answers = []
        for piece in pieces:
            echoed = super().play(piece)
            while echoed and len(answers) < 20:
                answers += echoed
                delay_s = len(echoed[0]) * TIMING.character_s
                echoed = super().play(delay_s, spoil(echoed[0]))
        return answers


ANSWER_EQUALS_REQUEST = [VENT, HOLD, bytes.fromhex("08 0000 a537"), bytes.fromhex("16 0204 fffe 0000")]


@pytest.mark.parametrize("pdu", ANSWER_EQUALS_REQUEST, ids=lambda pdu: pdu.hex())
def test_an_echo_is_not_answered_if_nothing_is_known_about_the_line(pdu):
    line = EchoingLine()
    assert line.play(encode_frame(1, pdu)) == [encode_frame(1, pdu)]
    assert len(line.source.write_requests) <= 1


@pytest.mark.parametrize("pdu", ANSWER_EQUALS_REQUEST, ids=lambda pdu: pdu.hex())
def test_a_line_that_echoes_loses_no_request(pdu):
    line = EchoingLine()
    for _ in range(3):
        assert line.play(READ, MASTER_PAUSE_S) == [READ_ANSWER]
        for _ in range(3):
            assert line.play(encode_frame(1, pdu), MASTER_PAUSE_S) == [encode_frame(1, pdu)]


@pytest.mark.parametrize("pdu", ANSWER_EQUALS_REQUEST, ids=lambda pdu: pdu.hex())
def test_on_a_line_without_echo_a_request_may_be_repeated_at_once(line, pdu):
    assert line.play(READ, SILENCE_S, READ) == [READ_ANSWER] * 2
    answers = line.play(
        *[encode_frame(1, pdu), SILENCE_S, encode_frame(1, pdu), SILENCE_S, READ, SILENCE_S] * 20
    )
    assert answers == [encode_frame(1, pdu), encode_frame(1, pdu), READ_ANSWER] * 20


@pytest.mark.parametrize("pdu", ANSWER_EQUALS_REQUEST, ids=lambda pdu: pdu.hex())
def test_the_third_equal_request_without_a_pause_is_lost_once(line, pdu):
    request = encode_frame(1, pdu)
    line.play(READ, SILENCE_S, READ)
    assert line.play(*[request, SILENCE_S] * 3) == [request] * 2
    assert line.play(0.1, request) == [request]


@pytest.mark.parametrize("pdu", ANSWER_EQUALS_REQUEST, ids=lambda pdu: pdu.hex())
def test_if_nothing_is_known_about_the_line_only_an_immediate_repetition_is_lost(line, pdu):
    request = encode_frame(1, pdu)
    assert line.play(request, SILENCE_S, request) == [request]
    assert line.play(0.1, request) == [request]
    assert line.play(0.1, request) == [request]


def test_an_echo_and_a_request_that_arrive_at_once_are_distinguished(line):
    for pdu in (VENT, HOLD):
        assert line.play(READ) == [READ_ANSWER]
        assert line.play(READ_ANSWER + encode_frame(1, pdu)) == [encode_frame(1, pdu)]
        assert line.play(encode_frame(1, pdu) + READ) == [READ_ANSWER]
        assert line.play(READ_ANSWER) == []
    assert [request["mode"] for request in line.source.write_requests] == ["vent", "hold"]


def test_an_echo_that_comes_late_is_answered_at_most_once():
    """After a long suspension, the process cannot distinguish a late echo from a request."""
    line = EchoingLine()
    assert line.play(READ) == [READ_ANSWER]
    assert VirtualLine.play(line, encode_frame(1, HOLD)) == [encode_frame(1, HOLD)]
    assert VirtualLine.play(line, 0.5, encode_frame(1, HOLD)) == [encode_frame(1, HOLD)]
    assert VirtualLine.play(line, encode_frame(1, HOLD)) == []


def test_a_damaged_echo_is_no_evidence_for_a_line_without_echo():
    line = EchoingLine()
    line.play(READ, spoil=lambda echo: echo[:3] + b"\xff" + echo[4:])
    assert line.play(encode_frame(1, HOLD)) == [encode_frame(1, HOLD)]


def test_one_echo_of_an_answer_shows_that_the_line_echoes_now():
    line = EchoingLine()
    VirtualLine.play(line, READ, SILENCE_S, READ)
    assert line.play(READ) == [READ_ANSWER]
    assert line.play(encode_frame(1, HOLD)) == [encode_frame(1, HOLD)]


@pytest.mark.parametrize("pdu", ANSWER_EQUALS_REQUEST, ids=lambda pdu: pdu.hex())
def test_a_request_is_carried_out_at_most_twice_if_the_line_starts_to_echo(pdu):
    """The unit has detected a line without echo. Then the adapter is replaced by an adapter with an echo."""
    line = EchoingLine()
    VirtualLine.play(line, READ, SILENCE_S, READ)
    assert [len(line.play(encode_frame(1, pdu), MASTER_PAUSE_S)) for _ in range(3)] == [2, 1, 1]


def test_reopening_the_port_resets_the_echo_state():
    line = EchoingLine()
    VirtualLine.play(line, READ, SILENCE_S, READ)
    line.unit.feed(READ[:4], line.now_s)
    line.unit.reset()
    assert line.play(encode_frame(1, HOLD)) == [encode_frame(1, HOLD)]
    assert line.unit.lost_bytes == 4
