"""Tests of the function block PF_Diagnostics, in virtual time."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuforce.registers.codes import FAULTS
from pneuforce.registers.document_text import DIAGNOSTIC_BLOCK
from pneuforce.registers.map import MAP_VERSION, REGISTERS
from pneuforce.registers.map_hash import MAP_HASH
from pneuforce.registers.modbus.register_bank import RegisterBank
from pneuforce.registers.views.st_reading import member
from tests.registers.views.structured_text.blocks import Block
from tests.registers.views.structured_text.test_reading import bytes_of, words_of

pytestmark = pytest.mark.usefixtures("blocks")
READ = [register for register in REGISTERS if register.address in DIAGNOSTIC_BLOCK]
MATCHING = {"map_version": MAP_VERSION, "map_hash": MAP_HASH}


def words(low_first=False, **codes):
    """Return the words of the diagnostic registers, which contain `codes`, and otherwise 0."""
    bank = RegisterBank(word_swap=low_first)
    codes = MATCHING | codes
    return words_of(b"".join(bank.encode_words(register, codes.get(register.name, 0)) for register in READ))


class Plc:
    """Block that is called every 10 ms, and a master that answers its request in the next cycle."""

    def __init__(self):
        self.block, self.now_s, self.reads_s = Block("PF_Diagnostics"), 0.0, []
        self.answer = {"Done": True, "Error": False}
        self.words = words()

    def run(self, seconds, **inputs):
        for _ in range(round(seconds / 0.01)):
            reads = bool(self.block["Read"])
            if reads and self.answer:
                self.reads_s.append(self.now_s)
                self.block.words(self.words)
            answer = self.answer if reads and self.answer else {"Done": False, "Error": False}
            self.now_s = round(self.now_s + 0.01, 2)
            self.block.cycle(self.now_s, **answer, **inputs)
        return self

    @property
    def fault(self):
        return FAULTS.names.get(int(self.block["Values.FirstOutFault"]), "none")


def test_the_registers_are_read_after_a_connect_and_then_each_interval():
    plc = Plc().run(3.0, Fresh=False)
    assert plc.reads_s == []
    plc.run(0.1, Fresh=True)
    assert len(plc.reads_s) == 1
    assert (plc.block["Valid"], plc.block["MapMatches"]) == (1, 1)
    plc.run(59.8)
    assert len(plc.reads_s) == 1
    plc.run(0.3)
    assert len(plc.reads_s) == 2


def test_values_are_not_valid_until_the_first_answer_and_after_an_interruption():
    plc = Plc()
    plc.answer = None
    assert plc.run(5.0, Fresh=True).block["Valid"] == 0
    assert plc.block["Read"] == 1
    plc.answer = {"Done": True, "Error": False}
    assert plc.run(0.1).block["Valid"] == 1
    assert plc.run(0.02, Fresh=False).block["Valid"] == 0
    assert plc.run(1.2, Fresh=True).block["Valid"] == 1


def test_an_answer_to_a_request_from_before_an_interruption_is_old():
    plc = Plc().run(1.2, Fresh=True)
    plc.answer = None
    plc.run(1.2, Fresh=True, Failure=True)
    assert plc.block["Read"] == 1
    plc.run(0.1, Fresh=False).run(0.1, Fresh=True)
    plc.answer = {"Done": True, "Error": False}
    assert plc.run(0.05).block["Valid"] == 0
    assert plc.run(1.2).block["Valid"] == 1


def test_a_failure_is_read_at_once_and_then_each_second():
    plc = Plc().run(5.0, Fresh=True, Failure=False)
    before = len(plc.reads_s)
    plc.words = words(first_out_fault=FAULTS.codes["lease_expired"])
    plc.run(0.03, Failure=True)
    assert (plc.fault, plc.block["Valid"], len(plc.reads_s)) == ("lease_expired", 1, before + 1)
    plc.run(5.0)
    assert 4 <= len(plc.reads_s) - before - 1 <= 5
    plc.words = words()
    plc.run(1.2, Failure=False)
    assert (plc.fault, plc.block["Valid"]) == ("none", 1)
    count = len(plc.reads_s)
    assert len(plc.run(30.0).reads_s) == count


def test_a_rejected_request_is_repeated_after_a_second():
    plc = Plc()
    plc.answer = {"Done": False, "Error": True}
    plc.run(10.0, Fresh=True)
    assert 8 <= len(plc.reads_s) <= 10
    assert plc.block["Valid"] == 0
    plc.answer = {"Done": True, "Error": False}
    assert plc.run(1.2).block["Valid"] == 1
    plc.answer = {"Done": False, "Error": True}
    assert plc.run(60.5).block["Valid"] == 0


@pytest.mark.parametrize("name", MATCHING)
def test_another_map_does_not_match(name):
    plc = Plc()
    plc.words = words(**{name: MATCHING[name] + 1})
    assert plc.run(1.2, Fresh=True).block["MapMatches"] == 0


@given(
    found=st.lists(st.integers(0, 0xFFFF), min_size=len(DIAGNOSTIC_BLOCK), max_size=len(DIAGNOSTIC_BLOCK)),
    low_first=st.booleans(),
)
def test_any_words_decode_as_with_the_register_bank(found, low_first):
    block = Block("PF_Diagnostics").cycle(0.0, Fresh=True, LowWordFirst=low_first)
    block.cycle(2.0)
    assert block["Read"] == 1
    block.words(found)
    block.cycle(2.01, Done=True)
    codes = RegisterBank(word_swap=low_first).decode_words(READ, DIAGNOSTIC_BLOCK.start, bytes_of(found))
    assert [block[f"Values.{member(register)}"] for register in READ] == codes
