"""Simulated serial line in virtual time. Tests play bytes and pauses, and read the answers of the unit."""

from pneuforce.registers.modbus.rtu import RtuTiming, encode_frame
from pneuforce.registers.modbus.rtu_unit import ModbusRtuUnit
from tests.registers.modbus.memory_source import MemorySource
from tests.registers.modbus.serving import IDENTITY

TIMING = RtuTiming(19200)
SILENCE_S = TIMING.silence_s
READ = encode_frame(1, bytes.fromhex("04 0000 0002"))
READ_ANSWER = encode_frame(1, bytes.fromhex("04 04 3fa00000"))
VENT = bytes.fromhex("06 0204 0000")
HOLD = bytes.fromhex("06 0204 0001")


class VirtualLine:
    """Line on which bytes arrive without delay. After a silence, the answer of the unit is read."""

    def __init__(self, **options):
        self.source = MemorySource()
        self.unit = ModbusRtuUnit(self.source, 1, TIMING, IDENTITY, **options)
        self.now_s = 100.0
        self._silent = True

    def play(self, *pieces):
        """Play bytes and pauses [s], and a silence at the end. Return the answers of the unit."""
        answers = []
        for piece in (*pieces, SILENCE_S):
            if isinstance(piece, bytes):
                self.unit.feed(piece, self.now_s)
                self._silent = False
                continue
            if piece >= SILENCE_S and not self._silent:
                self._silent = True
                answers += [answer] if (answer := self.unit.answer(self.now_s + SILENCE_S)) else []
            self.now_s += piece
        return answers

    def send_request(self, pdu, unit=1):
        """Return the answer PDU to a request PDU, or "" if there is no answer. PDUs are hex texts."""
        answers = self.play(encode_frame(unit, bytes.fromhex(pdu)))
        assert all(answer == encode_frame(1, answer[1:-2]) for answer in answers)
        return answers[0][1:-2].hex(" ") if answers else ""
