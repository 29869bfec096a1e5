"""The reading blocks against our own decoder, over words that nobody chose."""

import math
import struct
from types import SimpleNamespace

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from registers.codes import STATUS
from registers.map import REGISTERS
from registers.modbus.bank import Bank
from registers.views.facts import MEASURED, TEST
from registers.views.st_reading import member, pascal
from tests.registers.views.structured_text.compiled import PYTESTMARKS, Block

pytestmark = [*PYTESTMARKS, pytest.mark.usefixtures("blocks")]
READ = [register for register in REGISTERS if register.address in MEASURED]
PATTERN = [register for register in REGISTERS if register.address in TEST]
FORCES = ("force", "force_uncompensated")
word = st.integers(0, 0xFFFF)
#: Words in which a float is often zero, subnormal, infinite, NaN or the largest.
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
def test_every_two_words_are_the_number_that_they_are_to_us(first, second, low_first):
    block = Block("PF_Decode").cycle(First=first, Second=second, LowWordFirst=low_first)
    bits = second << 16 | first if low_first else first << 16 | second
    (number,) = struct.unpack(">f", bits.to_bytes(4, "big"))
    assert block["Bits"] == bits
    assert block["Valid"] == math.isfinite(number)
    assert block["Value"] == (number if math.isfinite(number) else 0.0)


def reading(words, low_first=False, counters=(1, 2)):
    """A reading block that has seen the sample counter move."""
    block = Block("PF_Reading")
    order = Bank(word_swap=low_first)
    counter = next(register for register in READ if register.name == "sample_counter")
    for second, count in enumerate(counters):
        words = [*words]
        words[counter.address : counter.end] = words_of(order.words(counter, count))
        block.words(words)
        block.cycle(second / 10, CommunicationOk=True, LowWordFirst=low_first)
    return block, words


@given(words=st.lists(word | edge, min_size=36, max_size=36), low_first=st.booleans())
def test_every_block_of_words_has_the_values_that_our_decoder_gives(words, low_first):
    block, words = reading(words, low_first)
    codes = Bank(word_swap=low_first).codes(READ, 0, bytes_of(words))
    assert block["Fresh"] == 1
    for register, code in zip(READ, codes, strict=True):
        if register.bits:
            told = {bit.name for bit in STATUS.bits if block[f"Status.{pascal(bit.name)}"]}
            assert told == register.decode(code)
            continue
        value = block[f"Values.{member(register)}"]
        if register.not_available is None:
            assert value == code
            continue
        valid = math.isfinite(code) and code != register.not_available
        without = 5.0 if register.name in FORCES else 0.0
        assert block[f"Values.{member(register)}_Valid"] == valid, register.name
        assert value == (code if valid else without), register.name


def force(block):
    return SimpleNamespace(valid=block["Values.Force_N_Valid"], n=block["Values.Force_N"])


ONE_NEWTON = [0x3F80, 0x0000, *[0] * 34]


def test_an_image_that_was_never_seen_to_change_is_no_measurement():
    block, _ = reading(ONE_NEWTON, counters=[7])
    assert (force(block).valid, force(block).n) == (0, 5.0)
    block, _ = reading(ONE_NEWTON, counters=[7, 8])
    assert (force(block).valid, force(block).n) == (1, 1.0)


def test_a_frozen_image_becomes_invalid_within_the_time_allowed_and_the_highest_force_is_assumed():
    block, _ = reading(ONE_NEWTON)  # it moved at 0.1 s, and may stand for 0.5 s
    valid = [force(block.cycle(at / 100, ForceUpperLimit_N=7.5)).valid for at in range(11, 100)]
    assert 0.48 <= sum(valid) / 100 <= 0.52
    assert valid == sorted(valid, reverse=True)
    assert (block["Fresh"], force(block).n) == (0, 7.5)


def test_after_a_pause_of_the_communication_the_counter_has_to_move_again():
    block, words = reading(ONE_NEWTON)
    assert block.cycle(0.2, CommunicationOk=False)["Fresh"] == 0
    assert block.cycle(0.3, CommunicationOk=True)["Fresh"] == 0
    assert force(block).n == 5.0
    words[23] += 1
    block.words(words)
    assert block.cycle(0.4)["Fresh"] == 1


def test_a_counter_that_wraps_has_moved():
    block, _ = reading(ONE_NEWTON, counters=[0xFFFFFFFF, 0])
    assert block["Fresh"] == 1


@pytest.mark.parametrize("swapped", [False, True])
def test_the_test_registers_settle_the_word_order(swapped):
    bank = Bank(word_swap=swapped)
    block = Block("PF_WordOrder")
    block.words(words_of(b"".join(bank.words(r, r.constant) for r in PATTERN)))
    block.cycle()
    assert (block["Known"], block["LowWordFirst"]) == (1, swapped)


@given(words=st.lists(word, min_size=5, max_size=5))
@example(words=[0xF6C2, 0x66E6, 0x3412, 0x7856, 0xC7CF])  # the bytes of each word turned round
def test_other_words_are_no_pneuforce(words):
    block = Block("PF_WordOrder")
    block.words(words)
    assert block.cycle()["Known"] == 0
