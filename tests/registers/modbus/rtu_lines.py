"""A serial line in virtual time: pieces of bytes and pauses in, what the unit says out."""

from registers.modbus.rtu import Timing, frame
from registers.modbus.rtu_unit import Unit
from tests.registers.modbus.memory import MemorySource
from tests.registers.modbus.serving import IDENTITY

TIMING = Timing(19200)
SILENCE_S = TIMING.silence_s
READ = frame(1, bytes.fromhex("04 0000 0002"))
READ_ANSWER = frame(1, bytes.fromhex("04 04 3fa00000"))
VENT = bytes.fromhex("06 0204 0000")
HOLD = bytes.fromhex("06 0204 0001")


class VirtualLine:
    """Bytes arrive at once, pauses pass; where one is long enough, the unit is told, as its port would."""

    def __init__(self, **options):
        self.source = MemorySource()
        self.unit = Unit(self.source, 1, TIMING, IDENTITY, **options)
        self.now_s = 100.0
        self._silent = True

    def play(self, *pieces):
        """What the unit says while these come: bytes, or pauses in seconds; a silence ends them."""
        said = []
        for piece in (*pieces, SILENCE_S):
            if isinstance(piece, bytes):
                self.unit.feed(piece, self.now_s)
                self._silent = False
                continue
            if piece >= SILENCE_S and not self._silent:
                self._silent = True
                said += [answer] if (answer := self.unit.answer(self.now_s + SILENCE_S)) else []
            self.now_s += piece
        return said

    def asked(self, pdu, unit=1):
        """Hex of the answer's PDU to a request in hex; "" for silence."""
        said = self.play(frame(unit, bytes.fromhex(pdu)))
        assert all(answer == frame(1, answer[1:-2]) for answer in said)
        return said[0][1:-2].hex(" ") if said else ""
