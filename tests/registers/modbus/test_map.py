"""Every register is tested the moment it is declared."""

import math
from itertools import combinations

import pytest

from instrument.faults import HostFault
from instrument.rig.frames import Fault
from instrument.snapshot import Snapshot
from registers.codes import FAULTS, STATUS
from registers.field import UNITS, Wire
from registers.map import BLOCKS, MAP_HASH, REGISTERS
from registers.modbus.bank import Bank
from registers.modbus.codes import Code

WRITABLE_FLOATS = [r for r in REGISTERS if r.writable and r.wire is Wire.F32]
each_register = pytest.mark.parametrize("register", REGISTERS, ids=lambda r: r.name)
QUANTITIES = set(Snapshot._fields)


def span(register):
    """Least, middle and greatest code of a register."""
    if register.values:
        return list(register.values.names)
    if register.bits:
        return [0, *(1 << bit.number for bit in register.bits.bits)]
    low = register.wire.lowest if register.low is None else register.low
    high = register.largest if register.high is None else register.high
    return [low, (low + high) / 2 if register.wire is Wire.F32 else (low + high) // 2, high, *register.also]


@pytest.mark.parametrize("register", [r for r in REGISTERS if r.constant is None], ids=lambda r: r.name)
@pytest.mark.parametrize("word_swap", [False, True])
def test_the_whole_span_fits_its_words(register, word_swap):
    bank = Bank(word_swap=word_swap)
    for code in span(register):
        words = bank.words(register, register.encode(register.decode(code)))
        assert len(words) == 2 * register.wire.words
        assert bank.codes([register], register.address, words) == [pytest.approx(code, rel=1e-6)]


@each_register
def test_what_has_a_unit_can_say_that_it_is_not_available(register):
    if not register.unit or register.always:
        assert register.not_available is None
        return
    code = register.encode(math.nan)
    assert code != code if register.wire is Wire.F32 else code == register.wire.highest
    assert math.isnan(register.decode(code))
    assert register.encode(1e9) != code, "a great value looks like none"


@each_register
def test_a_quantity_exists_and_its_suffix_is_the_unit(register):
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
        assert one.end <= other.address or other.end <= one.address, f"{one.name} lies on {other.name}"


def test_names_are_unique():
    assert len({register.name for register in REGISTERS}) == len(REGISTERS)


def test_status_bits_are_unique_and_fit_32_bits():
    numbers = [bit.number for bit in STATUS.bits]
    assert len(set(numbers)) == len(numbers)
    assert set(numbers) <= set(range(32))


def test_every_fault_of_board_and_host_has_its_code_and_word():
    assert FAULTS.names == {fault: fault.name.lower() for fault in (*Fault, *HostFault)}


def test_the_instrument_tells_the_hash_of_its_map():
    data = Bank().reader(770, 2)(None)
    assert int.from_bytes(data, "big") == MAP_HASH != 0


@pytest.mark.parametrize("register", WRITABLE_FLOATS, ids=lambda r: r.name)
@pytest.mark.parametrize("code", [math.nan, math.inf, -math.inf])
def test_no_writable_register_takes_a_broken_number(register, code):
    assert Bank().writes(register.address, Bank().words(register, code)) == Code.ILLEGAL_VALUE
