"""A server as the register reference tells it, written down as plain words: a judge for the real one."""

from __future__ import annotations

import struct

from registers.map import BLOCKS, REGISTERS
from registers.source import Peer
from tests.registers.modbus.memory import MemorySource

WRITABLE = [r for r in REGISTERS if r.writable]
FORMATS = {"F32": ">f", "U32": ">I", "I16": ">h", "U16": ">H"}
MODE, REFUSAL, LEASE = 516, 27, 517
NO_REFUSAL, LEASE_REFUSAL = 0, 3
FUNCTION, ADDRESS, VALUE, BUSY = 1, 2, 3, 6


class LeasedSource(MemorySource):
    """Keeps what it is told, by the one who holds the lease; no sample comes in between."""

    holder: Peer | None = None

    def __init__(self):
        super().__init__(lambda peer, _: "none" if self.holder in (None, peer) else "lease")

    def snapshot(self, peer, now_s):
        self.values["sample_counter"] -= 1
        return super().snapshot(peer, now_s)

    def write(self, peer, values, now_s):
        refusal = super().write(peer, values, now_s)
        if refusal == "none" and "lease_s" in values:
            self.holder = peer if values["lease_s"] else None
        return refusal


class PlainServer:
    """Answers to functions 3, 4, 6, 16, 22 and 23 out of a table of words."""

    def __init__(self, *, word_swap, read_only):
        snapshot = LeasedSource().snapshot(Peer("modbus_tcp"), 0.0)
        self.words = {a: 0 for first, last in BLOCKS for a in range(first, last + 1)}
        for r in REGISTERS:
            code = r.encode(getattr(snapshot, r.quantity)) if r.constant is None else r.constant
            self._put(r, code)
        self.pairs = {
            r.address + i: r.address + 1 - i for r in REGISTERS if r.wire.words == 2 for i in (0, 1)
        }
        self.word_swap, self.read_only = word_swap, read_only
        self.holder, self.refusals = None, {}

    def answer(self, pdu, peer):
        function, *fields = struct.unpack_from(">BHH", pdu)
        if function in (3, 4):
            result = self._read(*fields, peer)
        elif function == 6:
            result = self._write(fields[0], pdu[3:], peer) or pdu[1:]
        elif function == 16:
            result = self._write(fields[0], pdu[6:], peer) or pdu[1:5]
        elif function == 22:
            result = self._mask(*struct.unpack(">HHH", pdu[1:]), peer) or pdu[1:]
        else:
            result = self._exchange(*fields, struct.unpack_from(">H", pdu, 5)[0], pdu[10:], peer)
        if isinstance(result, bytes):
            return bytes((function,)) + result
        return bytes((function | 0x80, result if function in (3, 4) or not self.read_only else FUNCTION))

    def _at(self, address):
        return self.pairs.get(address, address) if self.word_swap else address

    def _read(self, address, count, peer):
        if not 1 <= count <= 125:
            return VALUE
        if not any(first <= address and address + count - 1 <= last for first, last in BLOCKS):
            return ADDRESS
        shown = self.words | {REFUSAL: self.refusals.get(peer, NO_REFUSAL)}
        data = b"".join(shown[self._at(a)].to_bytes(2, "big") for a in range(address, address + count))
        return bytes((2 * count,)) + data

    def _mask(self, address, keep, put, peer):
        if address not in self.words:
            return ADDRESS
        word = self.words[self._at(address)] & keep | put & ~keep
        return self._write(address, word.to_bytes(2, "big"), peer)

    def _exchange(self, read_at, count, write_at, data, peer):
        if not 1 <= count <= 125:
            return VALUE
        unreadable = self._read(read_at, count, peer)
        refused = self._write(write_at, data, peer, unreadable if isinstance(unreadable, int) else None)
        return refused or self._read(read_at, count, peer)

    def _write(self, address, data, peer, refused=None):
        written = {
            self._at(address + i): int.from_bytes(data[2 * i : 2 * i + 2], "big")
            for i in range(len(data) // 2)
        }
        vents, alone = written.get(MODE) == 0, written == {MODE: 0}
        code = refused or self._verdict(written)
        if self.read_only and (code or not alone):
            code = FUNCTION
        if not code and not alone and self.holder not in (None, peer):
            code, self.refusals[peer] = BUSY, LEASE_REFUSAL
        elif vents or not code:
            self.refusals[peer] = NO_REFUSAL
        if vents:
            self.words[MODE] = 0
        if not code:
            self._carry_out(written, peer)
        return code

    def _verdict(self, written):
        if not written.keys() <= {a for r in WRITABLE for a in range(r.address, r.end)}:
            return ADDRESS
        for r in WRITABLE:
            own = set(range(r.address, r.end))
            if own & written.keys() and not (own <= written.keys() and allowed(r, self._code(r, written))):
                return VALUE
        return None

    def _carry_out(self, written, peer):
        self.words |= written
        for r in WRITABLE:
            if r.address in written:
                for twin in WRITABLE:
                    if twin is not r and twin.quantity == r.quantity:
                        self._put(twin, self._code(r, written) * twin.scale / r.scale)
        if LEASE in written:
            self.holder = peer if written[LEASE] else None

    def _put(self, register, code):
        code = code if register.wire.name == "F32" else round(code)
        data = struct.pack(FORMATS[register.wire.name], code)
        for i in range(len(data) // 2):
            self.words[register.address + i] = int.from_bytes(data[2 * i : 2 * i + 2], "big")

    def _code(self, register, words):
        data = b"".join(words[a].to_bytes(2, "big") for a in range(register.address, register.end))
        return struct.unpack(FORMATS[register.wire.name], data)[0]


def allowed(register, code):
    if register.values:
        return code in register.values.names
    return register.low is None or register.low <= code <= register.high or code in register.also
