"""Tests of the function blocks that decode registers. They decode random words as RegisterBank does."""

import math
import struct
from types import SimpleNamespace

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from pneuforce.registers.codes import STATUS
from pneuforce.registers.document_text import MEASURED_BLOCK, TEST_BLOCK
from pneuforce.registers.map import REGISTERS
from pneuforce.registers.modbus.register_bank import RegisterBank
from pneuforce.registers.views.st_reading import member, pascal
from tests.registers.views.structured_text.blocks import Block

pytestmark = pytest.mark.usefixtures("blocks")
READ = [register for register in REGISTERS if register.address in MEASURED_BLOCK]
PATTERN = [register for register in REGISTERS if register.address in TEST_BLOCK]
FORCES = ("force", "force_uncompensated")
word = st.integers(0, 0xFFFF)
#: High and low words of special floats: zero, subnormal numbers, infinity, NaN and the largest number.
edge = st.sampled_from(
    [0x0000, 0x8000, 0x0001, 0x7F80, 0xFF80, 0x7FC0, 0x7F7F, 0xFFFF, 0x0080, 0x007F, 0x807F]
)


def bytes_of(words):
    return b"".join(w.to_bytes(2, "big") for w in words)


def words_of(data):
    return [int.from_bytes(data[at : at + 2], "big") for at in range(0, len(data), 2)]


@given(first=word | edge, second=word | edge, low_first=st.booleans())
@example(first=0x0000, second=0x0001, low_first=False)
@example(first=0x7F7F, second=0xFFFF, low_first=False)
@example(first=0x007F, second=0xFFFF, low_first=False)
@example(first=0x0000, second=0xFF80, low_first=True)
def test_any_two_words_decode_to_the_correct_number(first, second, low_first):
    block = Block("PF_Decode").cycle(First=first, Second=second, LowWordFirst=low_first)
    bits = second << 16 | first if low_first else first << 16 | second
    (number,) = struct.unpack(">f", bits.to_bytes(4, "big"))
    assert block["Bits"] == bits
    assert block["Valid"] == math.isfinite(number)
    assert block["Value"] == (number if math.isfinite(number) else 0.0)


def reading(words, low_first=False, counters=(1, 2)):
    """Run a reading block once for each sample counter. Return the block and the words of its last run."""
    block = Block("PF_Reading")
    bank = RegisterBank(word_swap=low_first)
    counter = next(register for register in READ if register.name == "sample_counter")
    for second, count in enumerate(counters):
        words = [*words]
        words[counter.address : counter.end] = words_of(bank.encode_words(counter, count))
        block.words(words)
        block.cycle(second / 10, CommunicationOk=True, LowWordFirst=low_first)
    return block, words


@given(words=st.lists(word | edge, min_size=36, max_size=36), low_first=st.booleans())
def test_any_words_decode_as_with_the_register_bank(words, low_first):
    block, words = reading(words, low_first)
    codes = RegisterBank(word_swap=low_first).decode_words(READ, 0, bytes_of(words))
    assert block["Fresh"] == 1
    for register, code in zip(READ, codes, strict=True):
        if register.bits:
            names = {bit.name for bit in STATUS.bits if block[f"Status.{pascal(bit.name)}"]}
            assert names == register.decode(code)
            continue
        value = block[f"Values.{member(register)}"]
        if register.not_available is None:
            assert value == code
            continue
        valid = math.isfinite(code) and code != register.not_available
        substitute = 5.0 if register.name in FORCES else 0.0
        assert block[f"Values.{member(register)}_Valid"] == valid, register.name
        assert value == (code if valid else substitute), register.name


def force(block):
    return SimpleNamespace(valid=block["Values.Force_N_Valid"], n=block["Values.Force_N"])


ONE_NEWTON = [0x3F80, 0x0000, *[0] * 34]


def test_values_are_invalid_until_the_sample_counter_changes():
    block, _ = reading(ONE_NEWTON, counters=[7])
    assert (force(block).valid, force(block).n) == (0, 5.0)
    block, _ = reading(ONE_NEWTON, counters=[7, 8])
    assert (force(block).valid, force(block).n) == (1, 1.0)


def test_values_become_invalid_if_the_counter_stops_and_the_upper_force_limit_is_used():
    block, _ = reading(ONE_NEWTON)  # last change at 0.1 s, so the values stay valid until 0.6 s
    valid = [force(block.cycle(at / 100, ForceUpperLimit_N=7.5)).valid for at in range(11, 100)]
    assert 0.48 <= sum(valid) / 100 <= 0.52
    assert valid == sorted(valid, reverse=True)
    assert (block["Fresh"], force(block).n) == (0, 7.5)


def test_no_value_is_shown_while_the_counter_does_not_change():
    codes = [*ONE_NEWTON[:2] * 18]  # 1.0 in each REAL
    block, _ = reading(codes, counters=[7])
    assert block["Fresh"] == 0
    for register in READ:
        if register.not_available is not None:
            assert block[f"Values.{member(register)}_Valid"] == 0
            assert block[f"Values.{member(register)}"] == (5.0 if register.name in FORCES else 0.0)


def test_after_a_communication_failure_the_counter_must_change_again():
    block, words = reading(ONE_NEWTON)
    assert block.cycle(0.2, CommunicationOk=False)["Fresh"] == 0
    assert block.cycle(0.3, CommunicationOk=True)["Fresh"] == 0
    assert force(block).n == 5.0
    words[23] += 1
    block.words(words)
    assert block.cycle(0.4)["Fresh"] == 1


def test_a_counter_that_wraps_has_changed():
    block, _ = reading(ONE_NEWTON, counters=[0xFFFFFFFF, 0])
    assert block["Fresh"] == 1


@pytest.mark.parametrize("swapped", [False, True])
def test_the_test_registers_show_the_word_order(swapped):
    bank = RegisterBank(word_swap=swapped)
    block = Block("PF_WordOrder")
    block.words(words_of(b"".join(bank.encode_words(r, r.constant) for r in PATTERN)))
    block.cycle()
    assert (block["Known"], block["LowWordFirst"]) == (1, swapped)


@given(words=st.lists(word, min_size=5, max_size=5))
@example(words=[0xF6C2, 0x66E6, 0x3412, 0x7856, 0xC7CF])  # the bytes of each word are swapped
def test_other_words_are_not_a_pneuforce_instrument(words):
    block = Block("PF_WordOrder")
    block.words(words)
    assert block.cycle()["Known"] == 0
