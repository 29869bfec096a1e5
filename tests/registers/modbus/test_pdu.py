"""Request in hex, answer in hex: every rule of the Modbus face as a table."""

import logging
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from registers.modbus.bank import Bank
from registers.modbus.identity import Identity
from registers.modbus.pdu import Responder
from registers.source import Peer
from tests.registers.modbus.memory import AT_REST, MemorySource
from tests.registers.modbus.serving import IDENTITY

PLC = Peer("modbus_tcp", "127.0.0.1")
WRITTEN = ("setpoint_requested_kpa", "force_limit_n", "mode", "lease_s", "reference_pressure_kpa")
EIGHT_KPA = "41000000"


def over(source, read_only=False):
    return Responder(Bank(), source, Identity(IDENTITY), read_only=read_only)


def answer(request, source=None, read_only=False):
    pdu = over(source or MemorySource(), read_only).answer(bytes.fromhex(request), PLC, 0.0)
    return None if pdu is None else pdu.hex(" ")


def spaced(text):
    return bytes.fromhex(text).hex(" ")


READS = [
    ("03 0000 0002", "03 04 3fa00000"),  # force 1.25 N
    ("04 0000 0002", "04 04 3fa00000"),
    ("03 0001 0001", "03 02 0000"),  # half of it
    ("03 000c 0002", "03 04 7fc00000"),  # rise: not available
    ("03 0022 0001", "03 02 ffff"),  # delay: not available
    ("03 0045 0001", "03 02 7fff"),  # rise in Pa: not available
    ("03 0018 0002", "03 04 0004 0001"),  # age 4 ms, state vented
    ("03 0014 0002", "03 04 80008008"),  # status
    ("03 0040 0004", "03 08 04e2 0014 2134 1fbd"),  # 1250 mN, 20 mN, 8500 Pa, 8125 µm
    ("03 0f00 0005", "03 0a c2f6e666 12345678 cfc7"),  # test pattern
    ("03 0024 0003", "03 06 0000 0000 0000"),  # reserved
    ("02 0000 0020", "02 04 08800080"),
    ("02 0003 0001", "02 01 01"),
    ("02 001f 0001", "02 01 01"),
    ("02 000f 0002", "02 01 01"),
]

REFUSED_READS = [
    ("03 0000 0000", "83 03"),
    ("03 0000 007e", "83 03"),
    ("04 0000 ffff", "84 03"),
    ("03 0000 0080", "83 03"),  # quantity before address
    ("03 2710 0000", "83 03"),
    ("03 0000", "83 03"),
    ("03", "83 03"),
    ("03 0000 0001 00", "83 03"),
    ("03 007f 0002", "83 02"),  # leaves its block
    ("03 0080 0001", "83 02"),
    ("03 01ff 0002", "83 02"),
    ("03 0240 0001", "83 02"),
    ("03 ffff 0001", "83 02"),
    ("03 ffff 0002", "83 02"),  # no wrap
    ("03 ff9c 007d", "83 02"),
    ("02 0000 0000", "82 03"),
    ("02 0000 07d1", "82 03"),
    ("02 0000 07d0", "82 02"),
    ("02 0020 0001", "82 02"),
    ("02 001f 0002", "82 02"),
    ("02 00", "82 03"),
    ("01 0000 0001", "81 02"),  # no coils
    ("01 0000 0000", "81 03"),
    ("01 0000 07d1", "81 03"),
    ("01", "81 03"),
]

ACCEPTED_WRITES = [
    ("06 0204 0001", "06 0204 0001", {"mode": "hold"}),
    ("06 0220 1f40", "06 0220 1f40", {"setpoint_requested_kpa": 8.0}),
    ("06 0221 07d0", "06 0221 07d0", {"force_limit_n": 2.0}),
    ("10 0200 0002 04 41000000", "10 0200 0002", {"setpoint_requested_kpa": 8.0}),
    ("10 0200 0005 0a 41000000 40000000 0001", "10 0200 0005",
     {"setpoint_requested_kpa": 8.0, "force_limit_n": 2.0, "mode": "hold"}),
    ("10 0208 0004 08 5046 0002 0000 0007", "10 0208 0004",
     {"command_key": 0x5046, "command_code": "clear_faults", "command_argument": 0, "command_sequence": 7}),
    ("16 0204 fffe 0001", "16 0204 fffe 0001", {"mode": "hold"}),
    ("16 0220 00ff 1000", "16 0220 00ff 1000", {"setpoint_requested_kpa": 0x1088 / 1000}),  # 5000 is 1388h
    ("17 0200 0002 0200 0002 04 41000000", "17 04 41000000", {"setpoint_requested_kpa": 8.0}),
    ("17 0000 0002 0204 0001 02 0001", "17 04 3fa00000", {"mode": "hold"}),
]  # fmt: skip

REFUSED_WRITES = [
    ("06 0200 4100", "86 03"),  # half of the setpoint
    ("06 0201 0000", "86 03"),
    ("06 0204 0002", "86 03"),  # no such mode
    ("06 0220 07cf", "86 03"),  # 1999 Pa
    ("06 0220 2ee1", "86 03"),  # 12001 Pa
    ("06 0220 ffff", "86 03"),  # "not available"
    ("06 0000 0000", "86 02"),  # read-only
    ("06 0019 0000", "86 02"),
    ("06 020f 0000", "86 02"),  # reserved
    ("06 2710 0000", "86 02"),
    ("06 ffff 0000", "86 02"),
    ("06 0220", "86 03"),
    ("06 0204 00", "86 03"),  # half a vent is none
    ("06 0220 1f40 00", "86 03"),
    ("10 0200 0002 04 00004100", "90 03"),  # words swapped
    ("10 0200 0002 04 7fc00000", "90 03"),  # NaN
    ("10 0200 0002 04 7f800000", "90 03"),  # infinity
    ("10 0200 0002 04 ff800000", "90 03"),
    ("10 0200 0002 04 bf800000", "90 03"),  # -1
    ("10 0200 0002 04 414028f6", "90 03"),  # 12.01 kPa
    ("10 0200 0002 04 00000000", "90 03"),
    ("10 0200 0002 03 410000", "90 03"),  # byte count is not twice the quantity
    ("10 0200 0002 06 41000000 0000", "90 03"),
    ("10 0200 0002 04 4100", "90 03"),  # shorter than its count
    ("10 0200 0002 04 41000000 00", "90 03"),
    ("10 0200 0000 00", "90 03"),
    ("10 0200 0080 00", "90 03"),
    ("10 0200 007c f8 " + "0000" * 124, "90 03"),
    ("10 0200", "90 03"),
    ("10 0200 0003 06 41000000 4000", "90 03"),  # the last value half
    ("10 0200 0004 08 41000000 7fc00000", "90 03"),  # the second bad: nothing of the first
    ("10 01ff 0003 06 0000 41000000", "90 02"),
    ("10 0220 0003 06 1f40 07d0 0000", "90 02"),
    ("10 01ff 0003 06 0000 7fc00000", "90 02"),  # address before value
    ("10 ffff 0002 04 00000000", "90 02"),
    ("16 0200 0000 4100", "96 03"),  # half of a long value
    ("16 0204 0000 0002", "96 03"),
    ("16 0000 ffff 0000", "96 02"),
    ("16 0018 ffff 0000", "96 02"),
    ("16 020f ffff 0000", "96 02"),
    ("16 2710 ffff 0000", "96 02"),
    ("16 0204 ffff", "96 03"),
    ("17 0000 0000 0200 0002 04 41000000", "97 03"),
    ("17 0000 007e 0200 0002 04 41000000", "97 03"),
    ("17 0000 0002 0200 0000 00", "97 03"),
    ("17 0000 0002 0200 007a f4 " + "0000" * 122, "97 03"),
    ("17 0000 0002 0200 0002 03 410000", "97 03"),
    ("17 0000 0002 0200 0002 04 4100", "97 03"),
    ("17 0080 0002 0200 0002 04 41000000", "97 02"),  # unreadable: not written either
    ("17 ffff 0002 0200 0002 04 41000000", "97 02"),
    ("17 0000 0002 0000 0002 04 41000000", "97 02"),
    ("17 0000 0002 0200 0002 04 7fc00000", "97 03"),
    ("17 0000 0002", "97 03"),
    ("05 0000 ff00", "85 02"),  # no coils
    ("05 0000 0000", "85 02"),
    ("05 0000 0001", "85 03"),
    ("05 0204 ffff", "85 03"),
    ("05 0000", "85 03"),
    ("0f 0000 000a 02 ffff", "8f 02"),
    ("0f 0000 000a 01 ff", "8f 03"),
    ("0f 0000 000a 02 ff", "8f 03"),
    ("0f 0000 0000 00", "8f 03"),
    ("0f 0000 07b1 f7 " + "00" * 247, "8f 03"),
    ("0f 0000", "8f 03"),
]

OTHERS = [
    ("08 0000 a537", "08 0000 a537"),
    ("08 0000 a537 0102", "08 0000 a537 0102"),
    ("08 0001 0000", "88 01"),
    ("08 000a 0000", "88 01"),
    ("08 00", "88 03"),
    ("00", "80 01"),
    ("07", "87 01"),
    ("0b", "8b 01"),
    ("11", "91 01"),
    ("14 00", "94 01"),
    ("18 0000", "98 01"),
    ("64", "e4 01"),
    ("7f", "ff 01"),
    ("2b 0e 01 00", "2b 0e 01 83 00 00 03 00 09 706e6575666f726365 01 02 5046 02 03 302e31"),
    ("2b 0d 00 00", "ab 01"),
    ("2b 0e 05 00", "ab 03"),
    ("2b 0e 04 07", "ab 02"),
]


@pytest.mark.parametrize(("request_", "expected"), READS)
def test_a_read_is_answered(request_, expected):
    assert answer(request_) == spaced(expected)


@pytest.mark.parametrize(("request_", "expected"), REFUSED_READS + OTHERS)
def test_a_request_is_answered(request_, expected):
    source = MemorySource()
    assert answer(request_, source) == spaced(expected)
    assert source.asked == []


@pytest.mark.parametrize(("request_", "expected", "written"), ACCEPTED_WRITES)
def test_a_write_is_one_request_to_the_source(request_, expected, written):
    source = MemorySource()
    assert answer(request_, source) == spaced(expected)
    assert source.asked == [pytest.approx(written)]


@pytest.mark.parametrize(("request_", "expected"), REFUSED_WRITES)
def test_a_bad_write_changes_nothing(request_, expected):
    source = MemorySource()
    assert answer(request_, source) == spaced(expected)
    assert source.asked == []
    assert {name: source.values[name] for name in WRITTEN} == {name: AT_REST[name] for name in WRITTEN}


@pytest.mark.parametrize(
    "request_",
    ["06 0204 0001", "10 0200 0002 04 41000000", "16 0204 0000 0001", "17 0000 0002 0204 0001 02 0001"],
)
def test_what_the_source_refuses_is_answered_with_06(request_):
    source = MemorySource(refuse=lambda peer, values: "state")
    assert answer(request_, source) == f"{int(request_[:2], 16) | 0x80:x} 06"
    assert answer("03 001b 0001", source) == "03 02 00 01", "the refusal register says why"
    assert source.values["mode"] == "vent"


VENTS = [
    ("06 0204 0000", "06 0204 0000"),
    ("10 0204 0001 02 0000", "10 0204 0001"),
    ("16 0204 0000 0000", "16 0204 0000 0000"),
    ("16 0204 fffe 0000", "16 0204 fffe 0000"),
    ("17 0000 0002 0204 0001 02 0000", "17 04 3fa00000"),
]
VENTS_IN_BAD_COMPANY = [
    ("10 0202 0003 06 7fc00000 0000", "90 03"),  # a broken force limit
    ("10 0203 0002 04 0000 0000", "90 03"),  # half a force limit
    ("10 0204 0002 04 0000 0001", "90 03"),  # a lease too short
    ("10 01ff 0006 0c 0000 41000000 40000000 0000", "90 02"),
    ("10 0204 0009 12 " + "0000" * 9, "90 02"),  # runs into what is read-only
    ("17 0080 0001 0204 0001 02 0000", "97 02"),  # unreadable
]


@pytest.mark.parametrize(("request_", "expected"), VENTS)
@pytest.mark.parametrize("read_only", [False, True])
def test_a_vent_is_never_refused(request_, expected, read_only):
    source = MemorySource(refuse=lambda peer, values: "lease")
    source.values["mode"] = "hold"
    assert answer(request_, source, read_only) == spaced(expected)
    assert source.asked == [{"mode": "vent"}]


@pytest.mark.parametrize(("request_", "expected"), VENTS_IN_BAD_COMPANY)
@pytest.mark.parametrize("read_only", [False, True])
def test_a_vent_among_words_that_are_refused_is_carried_out(request_, expected, read_only):
    source = MemorySource()
    source.values["mode"] = "hold"
    assert answer(request_, source, read_only) == (expected[:3] + "01" if read_only else expected)
    assert source.asked == [{"mode": "vent"}]


def test_a_read_only_instrument_vents_and_takes_nothing_else_of_the_request():
    source = MemorySource()
    assert answer("10 0204 0002 04 0000 00c8", source, read_only=True) == "90 01"
    assert source.asked == [{"mode": "vent"}]


def test_a_vent_reaches_the_source_with_the_rest_of_an_acceptable_request():
    source = MemorySource(refuse=lambda peer, values: "lease")
    source.values["mode"] = "hold"
    assert answer("10 0200 0005 0a 41000000 40000000 0000", source) == "90 06"
    assert source.asked == [{"setpoint_requested_kpa": 8.0, "force_limit_n": 2.0, "mode": "vent"}]
    assert source.values["mode"] == "vent"


@pytest.mark.parametrize("request_", [request for request, *_ in ACCEPTED_WRITES + REFUSED_WRITES])
def test_a_read_only_instrument_has_no_write_functions(request_):
    source = MemorySource()
    assert answer(request_, source, read_only=True) == f"{int(request_[:2], 16) | 0x80:x} 01"
    assert source.asked == []


@pytest.mark.parametrize("function", [0x80, 0x83, 0xFF])
def test_a_function_that_no_request_has_ends_the_connection(function):
    assert answer(f"{function:x} 0000 0001") is None


def test_a_failing_source_is_answered_with_04_and_logged_sparingly(caplog):
    class Failing(MemorySource):
        def snapshot(self, peer, now_s):
            raise ZeroDivisionError("a mistake of ours")

    responder = over(Failing())
    with caplog.at_level(logging.WARNING):
        answers = [responder.answer(bytes.fromhex("0300000002"), PLC, 0.001 * i) for i in range(900)]
        responder.answer(bytes.fromhex("0300000002"), PLC, 2.0)
    assert set(answers) == {b"\x83\x04"}
    assert responder.answer(bytes.fromhex("08000001"), PLC, 3.0) == bytes.fromhex("08000001")
    assert "a mistake of ours" in caplog.text
    assert "895 more lines were held back" in caplog.text
    assert len(caplog.records) == 7


def test_a_vent_needs_nothing_that_can_be_measured():
    class Blind(MemorySource):
        def snapshot(self, peer, now_s):
            raise ZeroDivisionError

    source = Blind()
    answer("17 0000 0002 0204 0001 02 0000", source)
    assert source.asked == [{"mode": "vent"}]


def test_one_answer_shows_one_sample():
    """The counter stands within the block that is read: each answer takes exactly one snapshot."""
    source = MemorySource()
    before = source.values["sample_counter"]
    words = bytes.fromhex(answer("04 0000 0024", source))[2:]
    assert struct.unpack_from(">I", words, 2 * 22)[0] == before + 1 == source.values["sample_counter"]


def test_the_peer_that_asks_reaches_the_source():
    seen = []
    source = MemorySource(refuse=lambda peer, values: seen.append(peer) or "none")
    answer("06 0204 0001", source)
    assert seen == [PLC]


@given(st.one_of(
    st.binary(min_size=1, max_size=253),
    st.builds(lambda f, rest: bytes((f,)) + rest, st.sampled_from((1, 2, 3, 4, 5, 6, 8, 15, 16, 22, 23, 43)),
              st.binary(max_size=30)),
))  # fmt: skip
def test_any_bytes_get_an_answer_of_their_function(pdu):
    source = MemorySource()
    reply = over(source).answer(pdu, PLC, 0.0)
    if pdu[0] >= 0x80:
        assert reply is None
    else:
        assert reply[0] & 0x7F == pdu[0]
        assert len(reply) <= 253
        assert reply[0] < 0x80 or (len(reply) == 2 and reply[1] in (1, 2, 3))
