"""Tests of the request handler: tables of requests and expected answers as hex texts."""

import logging
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.registers.modbus.memory_source import MemorySource
from tests.registers.modbus.pdu_requests import PLC, answer, request_handler, spaced

READS = [
    ("03 0000 0002", "03 04 3fa00000"),  # force 1.25 N
    ("04 0000 0002", "04 04 3fa00000"),
    ("03 0001 0001", "03 02 0000"),  # low word of the force
    ("03 000c 0002", "03 04 7fc00000"),  # rise: not available
    ("03 0022 0001", "03 02 ffff"),  # delay: not available
    ("03 0045 0001", "03 02 7fff"),  # rise in Pa: not available
    ("03 0018 0002", "03 04 0004 0001"),  # age 4 ms, state vented
    ("03 0014 0002", "03 04 80008008"),  # status
    ("03 0040 0004", "03 08 04e2 0014 2134 1fbd"),  # 1250 mN, 20 mN, 8500 Pa, 8125 µm
    ("03 0f00 0005", "03 0a c2f6e666 12345678 cfc7"),  # test pattern
    ("03 003c 0003", "03 06 0000 0000 0000"),  # reserved
    ("02 0000 0020", "02 04 08800080"),
    ("02 0003 0001", "02 01 01"),
    ("02 001f 0001", "02 01 01"),
    ("02 000f 0002", "02 01 01"),
]

REJECTED_READS = [
    ("03 0000 0000", "83 03"),
    ("03 0000 007e", "83 03"),
    ("04 0000 ffff", "84 03"),
    ("03 0000 0080", "83 03"),  # the quantity is checked before the address
    ("03 2710 0000", "83 03"),
    ("03 0000", "83 03"),
    ("03", "83 03"),
    ("03 0000 0001 00", "83 03"),
    ("03 007f 0002", "83 02"),  # the range ends outside the block
    ("03 0080 0001", "83 02"),
    ("03 01ff 0002", "83 02"),
    ("03 0240 0001", "83 02"),
    ("03 ffff 0001", "83 02"),
    ("03 ffff 0002", "83 02"),  # addresses do not wrap around
    ("03 ff9c 007d", "83 02"),
    ("02 0000 0000", "82 03"),
    ("02 0000 07d1", "82 03"),
    ("02 0000 07d0", "82 02"),
    ("02 0020 0001", "82 02"),
    ("02 001f 0002", "82 02"),
    ("02 00", "82 03"),
    ("01 0000 0001", "81 02"),  # there are no coils
    ("01 0000 0000", "81 03"),
    ("01 0000 07d1", "81 03"),
    ("01", "81 03"),
]

OTHER_REQUESTS = [
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


@pytest.mark.parametrize(("request_", "expected"), REJECTED_READS + OTHER_REQUESTS)
def test_a_request_is_answered(request_, expected):
    source = MemorySource()
    assert answer(request_, source) == spaced(expected)
    assert source.write_requests == []


@pytest.mark.parametrize("function", [0x80, 0x83, 0xFF])
def test_a_function_of_80h_or_above_has_no_answer(function):
    assert answer(f"{function:x} 0000 0001") is None


def test_an_error_of_the_source_is_answered_with_04_and_logged_with_a_rate_limit(caplog):
    class FailingSource(MemorySource):
        def snapshot(self, peer, now_s):
            raise ZeroDivisionError("injected error")

    failing = request_handler(FailingSource())
    with caplog.at_level(logging.WARNING):
        answers = [failing.answer(bytes.fromhex("0300000002"), PLC, 0.001 * i) for i in range(900)]
        failing.answer(bytes.fromhex("0300000002"), PLC, 2.0)
    assert set(answers) == {b"\x83\x04"}
    assert failing.answer(bytes.fromhex("08000001"), PLC, 3.0) == bytes.fromhex("08000001")
    assert "injected error" in caplog.text
    assert "not logged: 895 more lines" in caplog.text
    assert len(caplog.records) == 7


def test_one_answer_contains_one_snapshot():
    """The sample counter increases with each snapshot, so the counter shows how many snapshots were made."""
    source = MemorySource()
    before = source.values["sample_counter"]
    words = bytes.fromhex(answer("04 0000 0024", source))[2:]
    assert struct.unpack_from(">I", words, 2 * 22)[0] == before + 1 == source.values["sample_counter"]


@given(st.one_of(
    st.binary(min_size=1, max_size=253),
    st.builds(lambda f, rest: bytes((f,)) + rest, st.sampled_from((1, 2, 3, 4, 5, 6, 8, 15, 16, 22, 23, 43)),
              st.binary(max_size=30)),
))  # fmt: skip
def test_any_bytes_get_an_answer_with_the_same_function(pdu):
    source = MemorySource()
    reply = request_handler(source).answer(pdu, PLC, 0.0)
    if pdu[0] >= 0x80:
        assert reply is None
    else:
        assert reply[0] & 0x7F == pdu[0]
        assert len(reply) <= 253
        assert reply[0] < 0x80 or (len(reply) == 2 and reply[1] in (1, 2, 3))
