"""The address space: which words stand where, and what written words mean."""

from __future__ import annotations

import struct
from array import array
from collections.abc import Callable, Iterable, Mapping
from functools import lru_cache
from operator import attrgetter
from typing import Any

from registers.field import Wire
from registers.map import BLOCKS, BY_NAME, REGISTERS, Register
from registers.modbus.codes import Code

MODE = BY_NAME["mode"]
STATUS = BY_NAME["status"]
#: The one request that is never refused.
VENT: Mapping[str, Any] = {MODE.quantity: "vent"}
DISCRETE_INPUTS = 32
_VENT_WORD = b"\x00\x00"
_LARGEST_F32 = 3.4028235e38
#: Ranges whose rendering is kept ready: more than masters poll, and few enough to stay small.
_RANGES_KEPT = 256

Reader = Callable[[Any], bytes]


class Bank:
    """The register map as big-endian words, the high word of a 32-bit value first (ABCD).

    `word_swap` puts the low word first (CDAB), for reads and writes alike.
    """

    def __init__(self, *, word_swap: bool = False) -> None:
        self.word_swap = word_swap
        self._order = "<" if word_swap else ">"
        self.reader = lru_cache(_RANGES_KEPT)(self._reader)

    def _reader(self, address: int, count: int) -> Reader | None:
        """What renders `count` words from `address` out of a snapshot; None where a word is in no block.

        Reserved words are 0; a range may begin or end within a 32-bit value.
        """
        end = address + count
        if not any(first <= address and end <= last + 1 for first, last in BLOCKS):
            return None
        registers = [r for r in REGISTERS if r.address < end and address < r.end]
        start = min([address, *(r.address for r in registers)])
        layout = struct.Struct(self._order + _layout(registers, start, end))
        codes = [_encoder(register) for register in registers]
        part = slice(2 * (address - start), 2 * (end - start))
        swap = self.word_swap
        seen, words = object(), b""

        def render(snapshot: Any) -> bytes:
            nonlocal seen, words
            if snapshot is not seen:  # who polls the same at the same instant is given the same
                data = _packed(layout, [code(snapshot) for code in codes])
                seen, words = snapshot, (_bytes_swapped(data) if swap else data)[part]
            return words

        return render

    def writes(self, address: int, words: bytes) -> dict[str, Any] | Code:
        """Quantities and values that `words`, written from `address`, stand for; or why they are refused.

        A word that is reserved, read-only or outside the map: ILLEGAL_ADDRESS. Half of a 32-bit value, or
        a value that is out of its span, not finite or not named: ILLEGAL_VALUE.
        """
        end = address + len(words) // 2
        if any(a not in _WRITABLE for a in range(address, end)):
            return Code.ILLEGAL_ADDRESS
        registers = list(dict.fromkeys(_WRITABLE[a] for a in range(address, end)))
        if registers[0].address < address or registers[-1].end > end:
            return Code.ILLEGAL_VALUE
        codes = self.codes(registers, address, words)
        if not all(r.accepts(code) for r, code in zip(registers, codes, strict=True)):
            return Code.ILLEGAL_VALUE
        return {r.quantity: r.decode(code) for r, code in zip(registers, codes, strict=True)}

    def codes(self, registers: Iterable[Register], address: int, words: bytes) -> list[float]:
        """Wire codes of whole `registers` within `words`, which begin at `address`."""
        data = _bytes_swapped(words) if self.word_swap else words
        return [
            struct.unpack_from(self._order + r.wire.code, data, 2 * (r.address - address))[0]
            for r in registers
        ]

    def words(self, register: Register, code: float) -> bytes:
        """Words that hold the wire code of one register."""
        data = struct.pack(self._order + register.wire.code, code)
        return _bytes_swapped(data) if self.word_swap else data


def asks_vent(address: int, words: bytes) -> bool:
    """Whether mode := vent is among `words` written from `address`."""
    at = 2 * (MODE.address - address)
    return at >= 0 and words[at : at + 2] == _VENT_WORD


def discrete_inputs(snapshot: Any, address: int, count: int) -> bytes | Code:
    """The status bits from `address` on, the first in the lowest bit of the first byte."""
    if address + count > DISCRETE_INPUTS:
        return Code.ILLEGAL_ADDRESS
    bits = int(STATUS.encode(getattr(snapshot, STATUS.quantity))) >> address & (1 << count) - 1
    return bits.to_bytes((count + 7) // 8, "little")


def _layout(registers: Iterable[Register], start: int, end: int) -> str:
    """`struct` codes of the registers between two addresses, pad bytes for what is reserved."""
    layout = ""
    for register in registers:
        layout += f"{2 * (register.address - start)}x{register.wire.code}"
        start = register.end
    return layout + f"{2 * max(end - start, 0)}x"


def _encoder(register: Register) -> Callable[[Any], float]:
    """What takes a register's wire code out of a snapshot."""
    if register.constant is not None:
        constant = register.constant
        return lambda _snapshot: constant
    quantity = attrgetter(register.quantity)
    if register.wire is Wire.F32 and register.scale == 1:
        return quantity
    return lambda snapshot: register.encode(quantity(snapshot))


def _packed(layout: struct.Struct, codes: list[float]) -> bytes:
    try:
        return layout.pack(*codes)
    except OverflowError:  # a number that float32 cannot hold is no measurement
        return layout.pack(*(code if abs(code) <= _LARGEST_F32 else float("nan") for code in codes))


def _bytes_swapped(data: bytes) -> bytes:
    """The bytes of each word exchanged: little-endian data become low word first, each word big-endian."""
    words = array("H", data)
    words.byteswap()
    return words.tobytes()


_WRITABLE = {
    a: register for register in REGISTERS if register.writable for a in range(register.address, register.end)
}
