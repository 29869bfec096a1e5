"""Register bank: conversion between Modbus words and the quantities of the register map."""

from __future__ import annotations

import struct
from array import array
from collections.abc import Callable, Iterable, Mapping
from functools import lru_cache
from operator import attrgetter
from typing import Any

from pneuforce.registers.field import WireType
from pneuforce.registers.map import BLOCKS, BY_NAME, REGISTERS, Register
from pneuforce.registers.modbus.exception_codes import ExceptionCode

MODE = BY_NAME["mode"]
STATUS = BY_NAME["status"]
#: The only write request that is never rejected.
VENT: Mapping[str, Any] = {MODE.quantity: "vent"}
DISCRETE_INPUT_COUNT = 32
_VENT_WORD = b"\x00\x00"
_MAX_F32 = 3.4028235e38
#: Number of cached readers. It is larger than the number of ranges that masters poll.
_READER_CACHE_SIZE = 256

Reader = Callable[[Any], bytes]


class RegisterBank:
    """Register map as big-endian words, with the high word of a 32-bit value first (ABCD).

    `word_swap` puts the low word first (CDAB), for reads and writes alike.
    """

    def __init__(self, *, word_swap: bool = False) -> None:
        self.word_swap = word_swap
        self._byte_order = "<" if word_swap else ">"
        self.reader = lru_cache(_READER_CACHE_SIZE)(self._reader)

    def _reader(self, address: int, count: int) -> Reader | None:
        """Return a function that takes a snapshot and returns `count` words, the first at `address`.

        Returns None if the range does not lie within one block. Reserved words read 0. The range may start or
        end within a 32-bit value.
        """
        end = address + count
        if not any(first <= address and end <= last + 1 for first, last in BLOCKS):
            return None
        registers = [r for r in REGISTERS if r.address < end and address < r.end]
        start = min([address, *(r.address for r in registers)])
        layout = struct.Struct(self._byte_order + _struct_format(registers, start, end))
        encoders = [_encoder(register) for register in registers]
        requested = slice(2 * (address - start), 2 * (end - start))
        swap = self.word_swap
        last_snapshot, words = object(), b""

        def read(snapshot: Any) -> bytes:
            nonlocal last_snapshot, words
            if snapshot is not last_snapshot:  # masters that poll at the same instant share one result
                data = _pack(layout, [encode(snapshot) for encode in encoders])
                last_snapshot, words = snapshot, (_swap_bytes(data) if swap else data)[requested]
            return words

        return read

    def decode_write(self, address: int, words: bytes) -> dict[str, Any] | ExceptionCode:
        """Return the new values of the quantities in `words`, which start at `address`, or an exception code.

        ILLEGAL_ADDRESS: a word is reserved, read-only or outside the map. ILLEGAL_VALUE: only half of a
        32-bit value is written, or a value is out of range, not finite or not a code of its enumeration.
        """
        end = address + len(words) // 2
        if any(a not in _WRITABLE for a in range(address, end)):
            return ExceptionCode.ILLEGAL_ADDRESS
        registers = list(dict.fromkeys(_WRITABLE[a] for a in range(address, end)))
        if registers[0].address < address or registers[-1].end > end:
            return ExceptionCode.ILLEGAL_VALUE
        codes = self.decode_words(registers, address, words)
        if not all(r.accepts(code) for r, code in zip(registers, codes, strict=True)):
            return ExceptionCode.ILLEGAL_VALUE
        return {r.quantity: r.decode(code) for r, code in zip(registers, codes, strict=True)}

    def decode_words(self, registers: Iterable[Register], address: int, words: bytes) -> list[float]:
        """Return the wire codes of `registers` from `words`, which start at `address`."""
        data = _swap_bytes(words) if self.word_swap else words
        return [
            struct.unpack_from(self._byte_order + r.wire.code, data, 2 * (r.address - address))[0]
            for r in registers
        ]

    def encode_words(self, register: Register, code: float) -> bytes:
        """Return the words that hold the wire code of one register."""
        data = struct.pack(self._byte_order + register.wire.code, code)
        return _swap_bytes(data) if self.word_swap else data


def contains_vent(address: int, words: bytes) -> bool:
    """Return True if a write of `words`, which start at `address`, contains mode := vent."""
    offset = 2 * (MODE.address - address)
    return offset >= 0 and words[offset : offset + 2] == _VENT_WORD


def discrete_inputs(snapshot: Any, address: int, count: int) -> bytes | ExceptionCode:
    """Return `count` status bits. The bit at `address` becomes the lowest bit of the first byte."""
    if address + count > DISCRETE_INPUT_COUNT:
        return ExceptionCode.ILLEGAL_ADDRESS
    bits = int(STATUS.encode(getattr(snapshot, STATUS.quantity))) >> address & (1 << count) - 1
    return bits.to_bytes((count + 7) // 8, "little")


def _struct_format(registers: Iterable[Register], start: int, end: int) -> str:
    """Return the `struct` format of the addresses `start` to `end`. Reserved words are pad bytes."""
    format_ = ""
    for register in registers:
        format_ += f"{2 * (register.address - start)}x{register.wire.code}"
        start = register.end
    return format_ + f"{2 * max(end - start, 0)}x"


def _encoder(register: Register) -> Callable[[Any], float]:
    """Return a function that takes a snapshot and returns the wire code of `register`."""
    if register.constant is not None:
        constant = register.constant
        return lambda _snapshot: constant
    quantity = attrgetter(register.quantity)
    if register.wire is WireType.F32 and register.scale == 1:
        return quantity
    return lambda snapshot: register.encode(quantity(snapshot))


def _pack(layout: struct.Struct, codes: list[float]) -> bytes:
    """Return the packed codes. A number that is too large for float32 becomes NaN (not available)."""
    try:
        return layout.pack(*codes)
    except OverflowError:
        return layout.pack(*(code if abs(code) <= _MAX_F32 else float("nan") for code in codes))


def _swap_bytes(data: bytes) -> bytes:
    """Return `data` with the two bytes of each word exchanged.

    Little-endian data become big-endian words with the low word first.
    """
    words = array("H", data)
    words.byteswap()
    return words.tobytes()


_WRITABLE = {
    a: register for register in REGISTERS if register.writable for a in range(register.address, register.end)
}
