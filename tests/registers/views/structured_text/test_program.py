"""The guide's program as it stands, in a PLC whose master serves it with the instrument, in virtual time."""

import struct

import pytest

from registers.modbus.bank import Bank
from registers.modbus.identity import Identity
from registers.modbus.pdu import Responder
from registers.source import Peer
from tests.instrument.driving import PLC, Drive
from tests.registers.modbus.serving import IDENTITY
from tests.registers.views.structured_text.compiled import PYTESTMARKS, Block
from tests.registers.views.structured_text.test_reading import words_of

pytestmark = [*PYTESTMARKS, pytest.mark.usefixtures("blocks")]


class Controller:
    """One task of 10 ms, and a master that serves it."""

    def __init__(self, word_swap=False):
        self.drive = Drive.zeroed()
        self.responder = Responder(Bank(word_swap=word_swap), self.drive.instrument, Identity(IDENTITY))
        self.program = Block("PneuForce")
        self.program.words(self.read(3840, 5), "TestWords")
        self.line_cut = False

    def ask(self, *request):
        return self.responder.answer(struct.pack(">BHH", *request), Peer(*PLC), self.drive.now_s)

    def read(self, address, count):
        return words_of(self.ask(4, address, count)[2:])

    def cycle(self):
        self.drive.run(0.01)
        answers = {"ReadOk": not self.line_cut, "WriteDone": 0, "WriteError": 0}
        if not self.line_cut:
            self.program.words(self.read(0, 36), "MeasuredWords")
            told = zip(("AnswerSequence", "AnswerState", "AnswerResult"), self.read(524, 3), strict=True)
            answers |= dict(told)
            if self.program["WriteNow"]:
                answer = self.ask(6, int(self.program["WriteAddress"]), int(self.program["WriteValue"]))
                refused = answer[0] > 0x80
                answers |= {"WriteDone": not refused, "WriteError": refused}
                answers["WriteException"] = answer[1] if refused else 0
        self.program.cycle(self.drive.now_s, **answers)

    def run(self, seconds, **inputs):
        for name, value in inputs.items():
            self.program[name] = value
        for _ in range(round(seconds / 0.01)):
            self.cycle()
        return self


@pytest.mark.parametrize("word_swap", [False, True])
def test_it_may_push_while_the_force_is_valid_and_below_its_limit(word_swap):
    plc = Controller(word_swap).run(0.5)
    assert plc.program["MayPush"] == 0
    plc.run(2.0, Inflate=1)
    assert plc.drive.see().state == "holding"
    assert plc.program["MayPush"] == 1
    plc.drive.push_kpa = 5.0
    plc.run(1.0)
    assert plc.drive.see().force_n > 3.0
    assert plc.program["MayPush"] == 0


def test_it_may_not_push_once_the_line_is_cut_and_the_lease_vents():
    plc = Controller().run(0.5).run(2.0, Inflate=1)
    assert plc.program["MayPush"] == 1
    plc.line_cut = True
    plc.run(0.05)
    assert plc.program["MayPush"] == 0
    plc.run(3.0)
    assert plc.drive.see().state == "tripped"
    plc.line_cut = False
    plc.run(1.0, Inflate=0, ClearFaults=1)
    plc.run(2.0, Inflate=1, ClearFaults=0)
    assert plc.program["MayPush"] == 1
