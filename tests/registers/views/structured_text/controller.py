"""Simulated PLC that runs the program of a tutorial with the instrument, in virtual time."""

import struct

from pneuforce.instrument.core.settings import Identity
from pneuforce.registers.codes import PROOF_TESTS
from pneuforce.registers.map_hash import MAP_HASH
from pneuforce.registers.modbus.device_identification import DeviceIdentification
from pneuforce.registers.modbus.pdu import RequestHandler
from pneuforce.registers.modbus.register_bank import RegisterBank
from pneuforce.registers.source import Peer
from tests.instrument.instrument_harness import PLC, InstrumentHarness
from tests.registers.modbus.serving import IDENTITY
from tests.registers.views.structured_text.blocks import Block
from tests.registers.views.structured_text.test_reading import words_of

REQUEST_NAMES = ("FunctionCode", "Address", "Count", "Value")


class Controller:
    """Simulated PLC with one task that runs the program of a tutorial."""

    cycle_s = 0.01  #: interval of the task

    def __init__(self, tutorial, word_swap=False, extended=False):
        self.tutorial = tutorial
        self.harness = InstrumentHarness.zeroed(identity=Identity(map_hash=MAP_HASH))
        self.request_handler = RequestHandler(
            RegisterBank(word_swap=word_swap), self.harness.instrument, DeviceIdentification(IDENTITY)
        )
        name = "PneuForceExtended" if extended else tutorial.program
        self.program = Block(name, tutorial.extended_text() if extended else tutorial.text())
        self.program["AllowSimulatedRig"] = 1
        self.line_cut = False
        self.waited_s = 0.0
        self.reads_s = []
        self.written = []  #: writes that the instrument has answered: time in s, address and value

    def serve(self, request):
        """Answer a waiting request, or let it time out."""
        get = {name: int(self.program[f"{request}.{name}"]) for name in REQUEST_NAMES}
        if self.line_cut or self.connection_is_broken:
            self.waited_s += self.cycle_s
            if self.waited_s < self.tutorial.timeout_s:
                return
            failed, code = True, self.tutorial.no_answer_code
        else:
            last = get["Value"] if get["FunctionCode"] == 6 else get["Count"]
            pdu = struct.pack(">BHH", get["FunctionCode"], get["Address"], last)
            answer = self.request_handler.answer(pdu, Peer(*PLC), self.harness.now_s)
            failed, code = answer[0] > 0x80, 0
            if get["FunctionCode"] == 6:
                self.written.append((self.harness.now_s, get["Address"], get["Value"]))
            if failed:
                code = self.tutorial.exception_base + answer[1]
            elif get["FunctionCode"] == 4:
                self.program.words(words_of(answer[2:]), "Master.Words")
                if get["Address"] == 0:
                    self.reads_s.append(self.harness.now_s)
        self.waited_s = 0.0
        for name, value in {"Reply": 1, "ReplyFailed": failed, "ReplyCode": code}.items():
            self.program[f"{request}.{name}"] = value

    @property
    def connection_is_broken(self):
        """Return True if only a new connection helps, which the program for ModbusFB must request."""
        return self.tutorial.file == "codesys.md" and self.program["Master.Client.Broken"]

    def cycle(self):
        self.harness.run(self.cycle_s)
        for name in self.tutorial.requests:
            if self.program[f"Master.{name}.Waiting"]:
                self.serve(f"Master.{name}")
        if self.tutorial.file == "codesys.md":
            self.program["Master.Client.LineOk"] = not self.line_cut
        self.program.cycle(self.harness.now_s)

    def run(self, seconds, **inputs):
        for name, value in inputs.items():
            self.program[name] = value
        for _ in range(round(seconds / self.cycle_s)):
            self.cycle()
        return self

    def read_proof_test(self):
        """Return "allowed" or "forbidden", as the PLC itself reads register 546."""
        answer = self.request_handler.answer(struct.pack(">BHH", 4, 546, 1), Peer(*PLC), self.harness.now_s)
        return PROOF_TESTS.names[words_of(answer[2:])[0]]

    @property
    def state(self):
        return self.harness.snapshot().state
