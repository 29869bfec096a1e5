"""Tests of every declared register."""

import math
from itertools import combinations

import pytest

from pneuforce.instrument.core.faults import HostFault
from pneuforce.instrument.core.snapshot import Snapshot
from pneuforce.protocol.frames import Fault
from pneuforce.registers.codes import FAULTS, STATUS
from pneuforce.registers.field import UNITS, WireType
from pneuforce.registers.map import BLOCKS, REGISTERS
from pneuforce.registers.modbus.exception_codes import ExceptionCode
from pneuforce.registers.modbus.register_bank import RegisterBank

WRITABLE_FLOATS = [r for r in REGISTERS if r.writable and r.wire is WireType.F32]
each_register = pytest.mark.parametrize("register", REGISTERS, ids=lambda r: r.name)
QUANTITIES = set(Snapshot._fields)


def sample_codes(register):
    """Return the smallest, middle and largest code of a register."""
    if register.values:
        return list(register.values.names)
    if register.bits:
        return [0, *(1 << bit.number for bit in register.bits.bits)]
    low = register.wire.min_code if register.low is None else register.low
    high = register.max_value_code if register.high is None else register.high
    return [
        low,
        (low + high) / 2 if register.wire is WireType.F32 else (low + high) // 2,
        high,
        *register.also_allowed,
    ]


@pytest.mark.parametrize("register", [r for r in REGISTERS if r.constant is None], ids=lambda r: r.name)
@pytest.mark.parametrize("word_swap", [False, True])
def test_the_complete_range_fits_the_words(register, word_swap):
    bank = RegisterBank(word_swap=word_swap)
    for code in sample_codes(register):
        words = bank.encode_words(register, register.encode(register.decode(code)))
        assert len(words) == 2 * register.wire.words
        assert bank.decode_words([register], register.address, words) == [pytest.approx(code, rel=1e-6)]


@each_register
def test_a_register_with_a_unit_has_a_not_available_code(register):
    if not register.unit or register.always_available:
        assert register.not_available is None
        return
    code = register.encode(math.nan)
    assert code != code if register.wire is WireType.F32 else code == register.wire.max_code
    assert math.isnan(register.decode(code))
    assert register.encode(1e9) != code, "a large value must not equal the not-available code"


def test_only_a_value_that_is_never_missing_has_no_not_available_code():
    always = {register.name for register in REGISTERS if register.always_available}
    assert always == {"sample_age", "lease", "lease_left"}


@each_register
def test_the_quantity_exists_and_its_name_ends_in_the_unit(register):
    if register.constant is not None:
        assert not register.quantity
        return
    assert register.quantity in QUANTITIES
    if register.unit:
        assert register.quantity.endswith("_" + UNITS[register.unit][0])
    else:
        assert not register.quantity.endswith(tuple("_" + suffix for suffix, _ in UNITS.values()))


@each_register
def test_a_register_lies_in_a_block(register):
    assert any(first <= register.address and register.end <= last + 1 for first, last in BLOCKS)


def test_no_two_registers_overlap():
    for one, other in combinations(REGISTERS, 2):
        assert one.end <= other.address or other.end <= one.address, f"{one.name} overlaps {other.name}"


def test_names_are_unique():
    assert len({register.name for register in REGISTERS}) == len(REGISTERS)


def test_status_bits_are_unique_and_fit_32_bits():
    numbers = [bit.number for bit in STATUS.bits]
    assert len(set(numbers)) == len(numbers)
    assert set(numbers) <= set(range(32))


def test_every_fault_of_board_and_host_has_its_code_and_name():
    assert FAULTS.names == {fault: fault.name.lower() for fault in (*Fault, *HostFault)}


@pytest.mark.parametrize("register", WRITABLE_FLOATS, ids=lambda r: r.name)
@pytest.mark.parametrize("code", [math.nan, math.inf, -math.inf])
def test_no_writable_register_accepts_nan_or_infinity(register, code):
    assert (
        RegisterBank().decode_write(register.address, RegisterBank().encode_words(register, code))
        == ExceptionCode.ILLEGAL_VALUE
    )
