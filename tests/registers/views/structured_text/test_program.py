"""Tests of the program in the PLC guide with a simulated PLC and the instrument, in virtual time."""

import struct

import pytest

from pneuforce.registers.modbus.device_identification import DeviceIdentification
from pneuforce.registers.modbus.pdu import RequestHandler
from pneuforce.registers.modbus.register_bank import RegisterBank
from pneuforce.registers.source import Peer
from tests.instrument.instrument_harness import PLC, InstrumentHarness
from tests.registers.modbus.serving import IDENTITY
from tests.registers.views.structured_text.blocks import Block
from tests.registers.views.structured_text.test_reading import words_of

pytestmark = pytest.mark.usefixtures("blocks")


class Controller:
    """Simulated PLC with one task of 10 ms, and its Modbus master."""

    def __init__(self, word_swap=False):
        self.harness = InstrumentHarness.zeroed()
        self.request_handler = RequestHandler(
            RegisterBank(word_swap=word_swap), self.harness.instrument, DeviceIdentification(IDENTITY)
        )
        self.program = Block("PneuForce")
        self.program["AllowSimulatedRig"] = 1
        self.program.words(self.read(3840, 5), "TestWords")
        self.line_cut = False

    def request(self, *request):
        return self.request_handler.answer(struct.pack(">BHH", *request), Peer(*PLC), self.harness.now_s)

    def read(self, address, count):
        return words_of(self.request(4, address, count)[2:])

    def cycle(self):
        self.harness.run(0.01)
        answers = {"ReadOk": not self.line_cut, "WriteDone": 0, "WriteError": 0}
        if not self.line_cut:
            self.program.words(self.read(0, 36), "MeasuredWords")
            values = zip(("AnswerSequence", "AnswerState", "AnswerResult"), self.read(524, 3), strict=True)
            answers |= dict(values)
            if self.program["WriteNow"]:
                answer = self.request(6, int(self.program["WriteAddress"]), int(self.program["WriteValue"]))
                rejected = answer[0] > 0x80
                answers |= {"WriteDone": not rejected, "WriteError": rejected}
                answers["WriteException"] = answer[1] if rejected else 0
        self.program.cycle(self.harness.now_s, **answers)

    def run(self, seconds, **inputs):
        for name, value in inputs.items():
            self.program[name] = value
        for _ in range(round(seconds / 0.01)):
            self.cycle()
        return self


@pytest.mark.parametrize("word_swap", [False, True])
def test_pushing_is_allowed_while_the_force_is_valid_and_below_its_limit(word_swap):
    plc = Controller(word_swap).run(0.5)
    assert plc.program["MayPush"] == 0
    plc.run(2.0, Inflate=1)
    assert plc.harness.snapshot().state == "holding"
    assert plc.program["MayPush"] == 1
    plc.harness.push_kpa = 3.5
    plc.run(1.0)
    assert plc.harness.snapshot().force_n > 2.2
    assert plc.program["MayPush"] == 0


def test_pushing_is_not_allowed_after_the_line_is_cut_and_the_lease_expires():
    plc = Controller().run(0.5).run(2.0, Inflate=1)
    assert plc.program["MayPush"] == 1
    plc.line_cut = True
    plc.run(0.05)
    assert plc.program["MayPush"] == 0
    plc.run(3.0)
    assert plc.harness.snapshot().state == "tripped"
    plc.line_cut = False
    plc.run(1.0, Inflate=0, ClearFaults=1)
    plc.run(2.0, Inflate=1, ClearFaults=0)
    assert plc.program["MayPush"] == 1
