"""Second, simple implementation of the Modbus server. Tests compare the real server with this one."""

from __future__ import annotations

import struct

from pneuforce.registers.map import BLOCKS, REGISTERS
from pneuforce.registers.source import Peer
from tests.registers.modbus.memory_source import MemorySource

WRITABLE = [r for r in REGISTERS if r.writable]
STRUCT_FORMATS = {"F32": ">f", "U32": ">I", "I16": ">h", "U16": ">H"}
MODE, REJECT_REASON, LEASE = 516, 27, 517
NOT_REJECTED, REJECTED_BY_LEASE = 0, 3
FUNCTION, ADDRESS, VALUE, BUSY = 1, 2, 3, 6


class LeasedSource(MemorySource):
    """Source that accepts writes from the lease holder only. Its sample counter does not change."""

    holder: Peer | None = None

    def __init__(self):
        super().__init__(lambda peer, _: "none" if self.holder in (None, peer) else "lease")

    def snapshot(self, peer, now_s):
        self.values["sample_counter"] -= 1
        return super().snapshot(peer, now_s)

    def write(self, peer, values, now_s):
        reason = super().write(peer, values, now_s)
        if reason == "none" and "lease_s" in values:
            self.holder = peer if values["lease_s"] else None
        return reason


class ReferenceServer:
    """Server for functions 3, 4, 6, 16, 22 and 23 that stores each word in a dictionary."""

    def __init__(self, *, word_swap, read_only):
        snapshot = LeasedSource().snapshot(Peer("modbus_tcp"), 0.0)
        self.words = {a: 0 for first, last in BLOCKS for a in range(first, last + 1)}
        for r in REGISTERS:
            code = r.encode(getattr(snapshot, r.quantity)) if r.constant is None else r.constant
            self._store(r, code)
        self.pairs = {
            r.address + i: r.address + 1 - i for r in REGISTERS if r.wire.words == 2 for i in (0, 1)
        }
        self.word_swap, self.read_only = word_swap, read_only
        self.holder, self.reject_reasons = None, {}

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
        shown = self.words | {REJECT_REASON: self.reject_reasons.get(peer, NOT_REJECTED)}
        data = b"".join(shown[self._at(a)].to_bytes(2, "big") for a in range(address, address + count))
        return bytes((2 * count,)) + data

    def _mask(self, address, and_mask, or_mask, peer):
        if address not in self.words:
            return ADDRESS
        word = self.words[self._at(address)] & and_mask | or_mask & ~and_mask
        return self._write(address, word.to_bytes(2, "big"), peer)

    def _exchange(self, read_at, count, write_at, data, peer):
        if not 1 <= count <= 125:
            return VALUE
        read = self._read(read_at, count, peer)
        error = self._write(write_at, data, peer, read if isinstance(read, int) else None)
        return error or self._read(read_at, count, peer)

    def _write(self, address, data, peer, earlier_error=None):
        written = {
            self._at(address + i): int.from_bytes(data[2 * i : 2 * i + 2], "big")
            for i in range(len(data) // 2)
        }
        vents, alone = written.get(MODE) == 0, written == {MODE: 0}
        code = earlier_error or self._error_of(written)
        if self.read_only and (code or not alone):
            code = FUNCTION
        if not code and not alone and self.holder not in (None, peer):
            code, self.reject_reasons[peer] = BUSY, REJECTED_BY_LEASE
        elif vents or not code:
            self.reject_reasons[peer] = NOT_REJECTED
        if vents:
            self.words[MODE] = 0
        if not code:
            self._carry_out(written, peer)
        return code

    def _error_of(self, written):
        if not written.keys() <= {a for r in WRITABLE for a in range(r.address, r.end)}:
            return ADDRESS
        for r in WRITABLE:
            addresses = set(range(r.address, r.end))
            if addresses & written.keys() and not (
                addresses <= written.keys() and allowed(r, self._code(r, written))
            ):
                return VALUE
        return None

    def _carry_out(self, written, peer):
        self.words |= written
        for r in WRITABLE:
            if r.address in written:
                for twin in WRITABLE:
                    if twin is not r and twin.quantity == r.quantity:
                        self._store(twin, self._code(r, written) * twin.scale / r.scale)
        if LEASE in written:
            self.holder = peer if written[LEASE] else None

    def _store(self, register, code):
        code = code if register.wire.name == "F32" else round(code)
        data = struct.pack(STRUCT_FORMATS[register.wire.name], code)
        for i in range(len(data) // 2):
            self.words[register.address + i] = int.from_bytes(data[2 * i : 2 * i + 2], "big")

    def _code(self, register, words):
        data = b"".join(words[a].to_bytes(2, "big") for a in range(register.address, register.end))
        return struct.unpack(STRUCT_FORMATS[register.wire.name], data)[0]


def allowed(register, code):
    if register.values:
        return code in register.values.names
    return register.low is None or register.low <= code <= register.high or code in register.also_allowed
