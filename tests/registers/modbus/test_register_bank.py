"""Tests of the register bank against a simple table of words."""

import struct
from types import SimpleNamespace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from pneuforce.registers.map import BLOCKS, REGISTERS
from pneuforce.registers.modbus.exception_codes import ExceptionCode
from pneuforce.registers.modbus.register_bank import RegisterBank, contains_vent, discrete_inputs
from tests.registers.modbus.memory_source import MemorySource

SNAPSHOT = MemorySource().snapshot(None, 0.0)
FORCE_AND_UNCERTAINTY = bytes.fromhex("3fa00000 3ca3d70a")  # 1.25 N, 0.02 N
WRITABLE = [r for r in REGISTERS if r.writable]
STRUCT_FORMATS = {"F32": ">f", "U32": ">I", "I16": ">h", "U16": ">H"}


def words_of(snapshot):
    """Return a dictionary from address to word. Each register is encoded on its own."""
    words = {a: b"\0\0" for first, last in BLOCKS for a in range(first, last + 1)}
    for r in REGISTERS:
        code = r.constant if r.constant is not None else r.encode(getattr(snapshot, r.quantity))
        data = struct.pack(STRUCT_FORMATS[r.wire.name], code)
        words.update({r.address + i: data[2 * i : 2 * i + 2] for i in range(len(data) // 2)})
    return words


WORDS = words_of(SNAPSHOT)


def read(address, count, bank=None, snapshot=SNAPSHOT):
    reader = (bank or RegisterBank()).reader(address, count)
    return None if reader is None else reader(snapshot)


def test_the_high_word_comes_first():
    assert read(0, 4) == FORCE_AND_UNCERTAINTY


def test_word_swap_puts_the_low_word_first():
    assert read(0, 4, RegisterBank(word_swap=True)) == bytes.fromhex("0000 3fa0 d70a 3ca3")
    assert read(3840, 5, RegisterBank(word_swap=True)) == bytes.fromhex("e666 c2f6 5678 1234 cfc7")


def test_half_of_a_long_value_can_be_read():
    assert read(1, 2) == FORCE_AND_UNCERTAINTY[2:6]


def test_reserved_registers_read_0():
    assert read(38, 26) == bytes(52)


@pytest.mark.parametrize("block", BLOCKS)
def test_a_read_across_the_end_of_a_block_is_rejected(block):
    first, last = block
    assert read(last, 1) is not None
    assert read(last, 2) is None
    assert first == 0 or read(first - 1, 2) is None


@settings(max_examples=300)
@given(st.one_of(st.integers(0, 140), st.integers(500, 810), st.integers(3830, 3860)), st.integers(1, 125))
def test_any_range_equals_its_words_one_by_one(address, count):
    range_ = range(address, address + count)
    within = any(first <= address and range_[-1] <= last for first, last in BLOCKS)
    assert read(address, count) == (b"".join(WORDS[a] for a in range_) if within else None)


def test_a_number_too_large_for_float32_reads_as_nan():
    assert read(0, 2, snapshot=SimpleNamespace(force_n=1e39)) == bytes.fromhex("7fc00000")


@pytest.mark.parametrize(
    ("address", "words", "decoded"),
    [
        (512, "41000000", {"setpoint_requested_kpa": 8.0}),
        (
            512,
            "41000000 40000000 0001",
            {"setpoint_requested_kpa": 8.0, "force_limit_n": 2.0, "mode": "hold"},
        ),
        (544, "1f40", {"setpoint_requested_kpa": 8.0}),
        (517, "0000", {"lease_s": 0.0}),
        (517, "00c8", {"lease_s": 0.2}),
        (517, "00c7", ExceptionCode.ILLEGAL_VALUE),  # below the shortest lease
        (512, "00000000", ExceptionCode.ILLEGAL_VALUE),
        (512, "00000001", ExceptionCode.ILLEGAL_VALUE),  # subnormal
        (512, "00004100", ExceptionCode.ILLEGAL_VALUE),  # 8.0 with its words swapped
        (512, "7fc00000", ExceptionCode.ILLEGAL_VALUE),  # NaN
        (512, "7f800000", ExceptionCode.ILLEGAL_VALUE),  # infinity
        (512, "bf800000", ExceptionCode.ILLEGAL_VALUE),  # -1
        (512, "414028f6", ExceptionCode.ILLEGAL_VALUE),  # 12.01
        (512, "4100", ExceptionCode.ILLEGAL_VALUE),  # only the high word of a float
        (513, "0000", ExceptionCode.ILLEGAL_VALUE),  # only the low word of a float
        (513, "0000 40000000", ExceptionCode.ILLEGAL_VALUE),  # the low word of a float, and a complete float
        (515, "0000 0001", ExceptionCode.ILLEGAL_VALUE),
        (516, "0002", ExceptionCode.ILLEGAL_VALUE),
        (521, "0007", ExceptionCode.ILLEGAL_VALUE),
        (520, "5045", ExceptionCode.ILLEGAL_VALUE),  # a wrong key
        (519, "0000", ExceptionCode.ILLEGAL_VALUE),
        (524, "0000", ExceptionCode.ILLEGAL_ADDRESS),  # read-only
        (527, "0000", ExceptionCode.ILLEGAL_ADDRESS),  # reserved
        (0, "41000000", ExceptionCode.ILLEGAL_ADDRESS),
        (511, "0000 41000000", ExceptionCode.ILLEGAL_ADDRESS),
        (523, "0001 0001", ExceptionCode.ILLEGAL_ADDRESS),  # includes read-only registers
        (9999, "0000", ExceptionCode.ILLEGAL_ADDRESS),
        (65535, "0000 0000", ExceptionCode.ILLEGAL_ADDRESS),
    ],
)
def test_written_words_are_decoded_or_rejected(address, words, decoded):
    assert RegisterBank().decode_write(address, bytes.fromhex(words)) == decoded


def test_word_swap_applies_to_writes():
    bank = RegisterBank(word_swap=True)
    assert bank.decode_write(512, bytes.fromhex("00004100")) == {"setpoint_requested_kpa": 8.0}
    assert bank.decode_write(512, bytes.fromhex("41000000")) == ExceptionCode.ILLEGAL_VALUE


@pytest.mark.parametrize(
    ("address", "words", "vents"),
    [(516, "0000", True), (514, "0000 0000 0000 0000", True), (516, "0001", False), (517, "0000", False),
     (514, "0000 0000", False), (0, "0000", False)],
)  # fmt: skip
def test_a_vent_is_found_among_other_words(address, words, vents):
    assert contains_vent(address, bytes.fromhex(words)) is vents


@given(st.integers(0, 40), st.integers(1, 40))
def test_discrete_inputs_are_the_status_bits(address, count):
    status = 1 << 3 | 1 << 15 | 1 << 31
    answer = discrete_inputs(SNAPSHOT, address, count)
    if address + count > 32:
        assert answer == ExceptionCode.ILLEGAL_ADDRESS
        return
    bits = [answer[i // 8] >> i % 8 & 1 for i in range(8 * len(answer))]
    assert bits[:count] == [status >> address + i & 1 for i in range(count)]
    assert not any(bits[count:])


class WritesAndReads(RuleBasedStateMachine):
    """Accepted values are read back from each register of the quantity. Rejected writes change nothing."""

    def __init__(self):
        super().__init__()
        self.bank = RegisterBank()
        self.source = MemorySource()
        self.words = words_of(SNAPSHOT)

    @rule(
        address=st.integers(508, 550),
        data=st.binary(min_size=2, max_size=8).filter(lambda b: len(b) % 2 == 0),
    )
    def write_anything(self, address, data):
        self.write(address, data)

    @rule(register=st.sampled_from([r for r in WRITABLE if r.low is not None]), part=st.floats(-0.2, 1.2))
    def write_a_number(self, register, part):
        code = register.low + part * (register.high - register.low)
        if register.wire.name != "F32":
            code = min(max(round(code), 0), 65535)
        self.write(register.address, struct.pack(STRUCT_FORMATS[register.wire.name], code))

    def write(self, address, data):
        decoded = self.bank.decode_write(address, data)
        if isinstance(decoded, ExceptionCode):
            assert decoded == self.expected_error(address, data)
        else:
            assert self.expected_error(address, data) is None
            self.source.write(None, decoded, 0.0)
            self.expect(address, data)

    def expected_error(self, address, data):
        written = set(range(address, address + len(data) // 2))
        if not written <= {a for r in WRITABLE for a in range(r.address, r.end)}:
            return ExceptionCode.ILLEGAL_ADDRESS
        for r in WRITABLE:
            addresses = set(range(r.address, r.end))
            if addresses & written and not addresses <= written:
                return ExceptionCode.ILLEGAL_VALUE
            if addresses <= written and not self.allowed(r, data[2 * (r.address - address) :]):
                return ExceptionCode.ILLEGAL_VALUE
        return None

    def allowed(self, r, data):
        code = struct.unpack_from(STRUCT_FORMATS[r.wire.name], data)[0]
        if r.values:
            return code in r.values.names
        return r.low is None or r.low <= code <= r.high or code in r.also_allowed

    def expect(self, address, data):
        """Store the written words, and update the other registers of the same quantities."""
        for i in range(len(data) // 2):
            self.words[address + i] = data[2 * i : 2 * i + 2]
        for r in WRITABLE:
            if address <= r.address < address + len(data) // 2:
                code = struct.unpack_from(STRUCT_FORMATS[r.wire.name], data, 2 * (r.address - address))[0]
                for twin in WRITABLE:
                    if twin is not r and twin.quantity == r.quantity:
                        self.store(twin, code * twin.scale / r.scale)

    def store(self, twin, code):
        rounded = code if twin.wire.name == "F32" else round(code)
        data = struct.pack(STRUCT_FORMATS[twin.wire.name], rounded)
        self.words.update({twin.address + i: data[2 * i : 2 * i + 2] for i in range(len(data) // 2)})

    @invariant()
    def everything_written_is_read_back(self):
        snapshot = self.source.snapshot(None, 0.0)
        data = read(512, 64, self.bank, snapshot)
        assert [data[2 * i : 2 * i + 2].hex() for i in range(64)] == [
            self.words[512 + i].hex() for i in range(64)
        ]


TestWritesAndReads = WritesAndReads.TestCase
