"""Rejected write requests of Modbus in words, for the log."""

from __future__ import annotations

import struct
from typing import NamedTuple

from pneuforce.registers.map import REGISTERS, Register
from pneuforce.registers.modbus.exception_codes import ExceptionCode
from pneuforce.registers.modbus.register_bank import RegisterBank
from pneuforce.support.rejected_write import RejectedWrite

MAX_NAMED = 4  #: number of registers of one request that the log names
MAX_EXAMINED_WORDS = 32
_AT = {address: register for register in REGISTERS for address in range(register.address, register.end)}
_REMEDIES = {
    ExceptionCode.ILLEGAL_FUNCTION: "this interface, or the role of this client, does not allow the write; "
    "a vent alone is always allowed",
    ExceptionCode.ILLEGAL_ADDRESS: "not all of the addresses belong to registers",
    ExceptionCode.ILLEGAL_VALUE: "the length of the request or its number of words is wrong",
}


class _Part(NamedTuple):
    """Register, part of a register, or address without a register, in a write request."""

    text: str
    end: int  #: first address after this part
    code: ExceptionCode | None = None  #: exception that this part causes
    allowed: str = ""


def rejected_request(pdu: bytes, code: ExceptionCode, bank: RegisterBank) -> RejectedWrite:
    """Return a rejected write request in words. `code` is the exception code of the answer."""
    reason = code.name.lower()
    remedy = _REMEDIES.get(code, "")
    if pdu[0] in (5, 15):
        if code is ExceptionCode.ILLEGAL_ADDRESS:
            remedy = "the instrument has no coils: write registers"
        return RejectedWrite(pdu, reason, f"coils {pdu[1:].hex(' ')}".rstrip(), remedy)
    if pdu[0] == 22 and len(pdu) == 7:
        part = _masked(pdu)
        return RejectedWrite(pdu, reason, part.text, part.allowed or remedy)
    target = _target(pdu)
    if target is None:
        return RejectedWrite(pdu, reason, f"function {pdu[0]}, {pdu[1:].hex(' ')}".rstrip(", "), remedy)
    parts = _parts(bank, *target, code)
    allowed = next((part.allowed for part in parts if part.code is code), remedy)
    named = [part.text for part in parts[:MAX_NAMED]]
    more = ["…"] if len(parts) > MAX_NAMED else []
    return RejectedWrite(pdu, reason, ", ".join(named + more), allowed)


def _target(pdu: bytes) -> tuple[int, bytes] | None:
    """Return the first address and the words of a write request, or None if the request has no words."""
    head = {6: 3, 16: 6, 23: 10}.get(pdu[0])
    words = pdu[head:] if head else b""
    if not words or len(words) % 2 or (pdu[0] == 6 and len(words) != 2):
        return None
    (address,) = struct.unpack_from(">H", pdu, 5 if pdu[0] == 23 else 1)
    return address, words


def _masked(pdu: bytes) -> _Part:
    """Return the part that a request of function 22 (mask write) changes."""
    address, and_mask, or_mask = struct.unpack_from(">HHH", pdu, 1)
    register = _AT.get(address)
    name = register.name if register else f"address {address}"
    text = f"{name} with the masks {and_mask:04X}h (AND) and {or_mask:04X}h (OR)"
    if register is None or not register.writable:
        allowed = f"{name} is read-only" if register else f"no register has the {name}"
        return _Part(text, address + 1, ExceptionCode.ILLEGAL_ADDRESS, allowed)
    is_half = register.wire.words > 1
    allowed = f"write both words of {name} together" if is_half else f"{name} {register.allowed_values}"
    return _Part(text, address + 1, ExceptionCode.ILLEGAL_VALUE, allowed)


def _parts(bank: RegisterBank, address: int, words: bytes, code: ExceptionCode) -> list[_Part]:
    """Return the parts of the first words, up to the part that causes the exception `code`.

    The number is limited because a peer can send many requests.
    """
    parts: list[_Part] = []
    at, end = address, address + min(len(words) // 2, MAX_EXAMINED_WORDS)
    while at < end:
        data = words[2 * (at - address) :]
        parts.append(_part(bank, _AT.get(at), at, data))
        at = parts[-1].end
        if len(parts) > MAX_NAMED and any(part.code is code for part in parts):
            break
    return parts


def _part(bank: RegisterBank, register: Register | None, at: int, data: bytes) -> _Part:
    """Return the part that begins at the address `at`. `data` contains its words and all later words."""
    if register is None:
        text = f"address {at} = {data[:2].hex()}h"
        return _Part(text, at + 1, ExceptionCode.ILLEGAL_ADDRESS, f"no register has the address {at}")
    if at != register.address or len(data) < register.wire.size:
        text, allowed = f"half of {register.name}", f"write both words of {register.name} together"
        read_only = not register.writable
        code = ExceptionCode.ILLEGAL_ADDRESS if read_only else ExceptionCode.ILLEGAL_VALUE
        return _Part(text, at + 1, code, f"{register.name} is read-only" if read_only else allowed)
    code_written = bank.decode_words([register], at, data[: register.wire.size])[0]
    text = register.describe(code_written)
    if not register.writable:
        return _Part(text, register.end, ExceptionCode.ILLEGAL_ADDRESS, f"{register.name} is read-only")
    if not register.accepts(code_written):
        allowed = f"{register.name} {register.allowed_values}"
        return _Part(text, register.end, ExceptionCode.ILLEGAL_VALUE, allowed)
    return _Part(text, register.end)
