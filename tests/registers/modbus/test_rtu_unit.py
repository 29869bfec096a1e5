"""One unit among others on a serial line: what it answers, what it carries out, and when it keeps silent."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from registers.modbus.rtu import frame
from tests.registers.modbus.rtu_lines import (
    HOLD,
    READ,
    READ_ANSWER,
    SILENCE_S,
    TIMING,
    VENT,
    VirtualLine,
)

MASTERS_PAUSE_S = 0.05
ANOTHERS_READ = frame(2, bytes.fromhex("04 0000 0002"))


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
        ("04 0000 00", "84 03"),  # of a wrong length, with a good CRC
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
    assert line.asked(request_) == answer


@pytest.mark.parametrize("pdu", ["80", "83 02", "ab 01", "ff"])
def test_what_is_an_exception_of_somebody_elses_is_not_answered(line, pdu):
    assert line.asked(pdu) == ""
    assert line.asked("04 0000 0002")


@pytest.mark.parametrize("unit", [2, 17, 247, 248, 255])
@pytest.mark.parametrize("pdu", ["04 0000 0002", "06 0204 0000", "06 0204 0001", "64"])
def test_another_unit_is_not_spoken_for(line, unit, pdu):
    assert line.asked(pdu, unit) == ""
    assert line.source.asked == []


@pytest.mark.parametrize("place", range(len(READ)))
def test_a_broken_request_is_met_with_silence_and_counted_and_the_next_is_answered(line, place):
    broken = READ[:place] + bytes((READ[place] ^ 0x10,)) + READ[place + 1 :]
    assert line.play(broken, 0.2) == []
    assert line.play(READ) == [READ_ANSWER]
    assert line.unit.lost_bytes == len(READ)


def test_a_broadcast_vents_and_is_not_answered(line):
    line.play(frame(1, HOLD))
    assert line.source.values["mode"] == "hold"
    assert line.asked("06 0204 0000", unit=0) == ""
    assert line.source.values["mode"] == "vent"
    assert line.unit.counters.broadcasts == 1


def test_a_vent_within_a_broadcast_is_carried_out_without_the_rest(line):
    line.source.values.update(mode="hold", force_limit_n=5.0)
    assert line.asked("10 0202 0003 06 40000000 0000", unit=0) == ""  # force limit 2 N, mode vent
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
    assert line.asked(pdu, unit=0) == ""
    assert line.source.asked == []
    assert line.unit.counters.broadcasts == 1


@pytest.mark.parametrize("pdu", ["06 0204 0001", "10 0202 0003 06 40000000 0000", "10", "05 0000 ff00"])
def test_what_is_broadcast_to_others_is_told_as_refused_nowhere(line, pdu, caplog):
    line.asked(pdu, unit=0)
    assert (line.source.turned_away, caplog.messages) == ([], [])


def test_a_unit_that_may_only_be_read_still_vents():
    line = VirtualLine(read_only=True)
    assert line.asked("06 0204 0001") == "86 01"
    assert line.asked("06 0204 0000") == "06 02 04 00 00"
    assert line.source.asked == [{"mode": "vent"}]


def test_the_low_word_comes_first_where_that_is_configured():
    assert VirtualLine(word_swap=True).asked("04 0000 0002") == "04 04 00 00 3f a0"


def test_who_asks_is_the_line(line):
    peers = []
    line.source.refuse = lambda peer, _values: peers.append(tuple(peer)) or "none"
    line.play(frame(1, HOLD))
    assert peers == [("modbus_rtu", "")]


NOISES = {
    "garbage": b"\x00\xff\x13\x37" * 5,
    "a request cut short": READ[:5],
    "our number, and no more": b"\x01",
    "another unit's request": ANOTHERS_READ,
    "another unit's request and its answer": ANOTHERS_READ + frame(2, READ_ANSWER[1:-2]),
    "another unit's answer that holds a request for us": frame(2, b"\x03\x08" + READ),
    "another unit's request, which is cut short": ANOTHERS_READ[:6],
    "a bad CRC": READ[:-1] + b"\x00",
    "an answer of another program that took our number": READ_ANSWER,
}


@pytest.mark.parametrize("noise", NOISES)
def test_what_is_not_for_us_costs_no_request_behind_a_silence(noise):
    for pause_s in (SILENCE_S, 0.01, 0.1, 1.0):
        line = VirtualLine()
        assert line.play(NOISES[noise], pause_s, READ)[-1:] == [READ_ANSWER]


@pytest.mark.parametrize("noise", sorted(set(NOISES) - {"an answer of another program that took our number"}))
def test_what_is_not_for_us_is_not_answered(line, noise):
    assert line.play(NOISES[noise], 1.0) == []


def test_bytes_between_two_silences_are_a_frame_whoever_sent_them(line):
    """What the standard's framing means; a unit that pauses within its frames breaks it."""
    before, behind = b"\x02\x03\x08", b"\x12\x34"
    assert line.play(before, SILENCE_S, READ, SILENCE_S, behind) == [READ_ANSWER]
    assert line.play(1.0, before, READ, SILENCE_S, behind) == []
    assert line.play(1.0, before, SILENCE_S, READ, behind) == []


@given(st.lists(st.tuples(st.binary(max_size=300), st.floats(0, 0.2)), max_size=20))
def test_after_any_garbage_and_a_silence_a_request_is_answered(garbage):
    line = VirtualLine()
    line.play(*(piece for pair in garbage for piece in pair), SILENCE_S)
    assert line.play(READ) == [READ_ANSWER]


def test_requests_that_a_late_scheduler_has_joined_are_all_carried_out_and_the_last_is_answered(line):
    assert line.play(frame(1, HOLD) + frame(1, VENT) + READ) == [READ_ANSWER]
    assert line.source.asked == [{"mode": "hold"}, {"mode": "vent"}]


def test_a_request_behind_which_another_unit_was_asked_is_carried_out_in_silence(line):
    assert line.play(frame(1, VENT) + ANOTHERS_READ) == []
    assert line.source.asked == [{"mode": "vent"}]


def test_a_request_behind_another_units_talk_is_answered_though_all_came_at_once(line):
    assert line.play(ANOTHERS_READ + frame(2, READ_ANSWER[1:-2]) + READ) == [READ_ANSWER]


def test_a_request_is_answered_when_the_silence_is_over_and_not_before(line):
    line.unit.feed(READ[:4], 0.0)
    line.unit.feed(READ[4:], 0.9 * SILENCE_S)
    assert line.unit.answer(1.9 * SILENCE_S) == READ_ANSWER
    assert line.unit.answer(3.0 * SILENCE_S) == b""


# ---- our own echo


class EchoingLine(VirtualLine):
    """Hears itself: what the unit says comes back, whole, before the master speaks again."""

    def play(self, *pieces, spoil=lambda echo: echo):
        said = []
        for piece in pieces:
            heard = super().play(piece)
            while heard and len(said) < 20:
                said += heard
                delay_s = len(heard[0]) * TIMING.character_s
                heard = super().play(delay_s, spoil(heard[0]))
        return said


ANSWERED_BY_THEMSELVES = [VENT, HOLD, bytes.fromhex("08 0000 a537"), bytes.fromhex("16 0204 fffe 0000")]


@pytest.mark.parametrize("pdu", ANSWERED_BY_THEMSELVES, ids=lambda pdu: pdu.hex())
def test_our_own_echo_is_not_answered_on_a_line_of_which_nothing_is_known(pdu):
    line = EchoingLine()
    assert line.play(frame(1, pdu)) == [frame(1, pdu)]
    assert len(line.source.asked) <= 1


@pytest.mark.parametrize("pdu", ANSWERED_BY_THEMSELVES, ids=lambda pdu: pdu.hex())
def test_a_line_that_echoes_loses_no_request(pdu):
    line = EchoingLine()
    for _ in range(3):
        assert line.play(READ, MASTERS_PAUSE_S) == [READ_ANSWER]
        for _ in range(3):
            assert line.play(frame(1, pdu), MASTERS_PAUSE_S) == [frame(1, pdu)]


@pytest.mark.parametrize("pdu", ANSWERED_BY_THEMSELVES, ids=lambda pdu: pdu.hex())
def test_on_a_line_without_echo_a_request_may_be_repeated_at_once(line, pdu):
    assert line.play(READ, SILENCE_S, READ) == [READ_ANSWER] * 2
    said = line.play(*[frame(1, pdu), SILENCE_S, frame(1, pdu), SILENCE_S, READ, SILENCE_S] * 20)
    assert said == [frame(1, pdu), frame(1, pdu), READ_ANSWER] * 20


@pytest.mark.parametrize("pdu", ANSWERED_BY_THEMSELVES, ids=lambda pdu: pdu.hex())
def test_who_says_the_same_at_once_for_the_third_time_has_to_say_it_once_more(line, pdu):
    request = frame(1, pdu)
    line.play(READ, SILENCE_S, READ)
    assert line.play(*[request, SILENCE_S] * 3) == [request] * 2
    assert line.play(0.1, request) == [request]


@pytest.mark.parametrize("pdu", ANSWERED_BY_THEMSELVES, ids=lambda pdu: pdu.hex())
def test_on_a_line_of_which_nothing_is_known_only_a_repetition_at_once_is_lost(line, pdu):
    request = frame(1, pdu)
    assert line.play(request, SILENCE_S, request) == [request]
    assert line.play(0.1, request) == [request]
    assert line.play(0.1, request) == [request]


def test_an_echo_and_the_next_request_that_came_at_once_are_told_apart(line):
    for pdu in (VENT, HOLD):
        assert line.play(READ) == [READ_ANSWER]
        assert line.play(READ_ANSWER + frame(1, pdu)) == [frame(1, pdu)]
        assert line.play(frame(1, pdu) + READ) == [READ_ANSWER]
        assert line.play(READ_ANSWER) == []
    assert [asked["mode"] for asked in line.source.asked] == ["vent", "hold"]


def test_an_echo_that_comes_late_is_answered_at_most_once():
    """The processor was away for so long that it looks like a request."""
    line = EchoingLine()
    assert line.play(READ) == [READ_ANSWER]
    assert VirtualLine.play(line, frame(1, HOLD)) == [frame(1, HOLD)]
    assert VirtualLine.play(line, 0.5, frame(1, HOLD)) == [frame(1, HOLD)]
    assert VirtualLine.play(line, frame(1, HOLD)) == []


def test_an_echo_that_arrives_garbled_does_not_make_the_line_one_without_echo():
    line = EchoingLine()
    line.play(READ, spoil=lambda echo: echo[:3] + b"\xff" + echo[4:])
    assert line.play(frame(1, HOLD)) == [frame(1, HOLD)]


def test_one_echo_of_an_answer_shows_that_the_line_echoes_now():
    line = EchoingLine()
    VirtualLine.play(line, READ, SILENCE_S, READ)
    assert line.play(READ) == [READ_ANSWER]
    assert line.play(frame(1, HOLD)) == [frame(1, HOLD)]


@pytest.mark.parametrize("pdu", ANSWERED_BY_THEMSELVES, ids=lambda pdu: pdu.hex())
def test_a_request_on_a_line_that_begins_to_echo_is_carried_out_twice_at_most(pdu):
    """An adapter was changed under way and nothing read since."""
    line = EchoingLine()
    VirtualLine.play(line, READ, SILENCE_S, READ)
    assert [len(line.play(frame(1, pdu), MASTERS_PAUSE_S)) for _ in range(3)] == [2, 1, 1]


def test_what_was_known_of_a_line_is_forgotten_when_its_port_is_opened_anew():
    line = EchoingLine()
    VirtualLine.play(line, READ, SILENCE_S, READ)
    line.unit.feed(READ[:4], line.now_s)
    line.unit.begin()
    assert line.play(frame(1, HOLD)) == [frame(1, HOLD)]
    assert line.unit.lost_bytes == 4
