"""Rejected writes by SDO in words, for the log."""

from __future__ import annotations

import struct

from pneuforce.registers.canopen.abort import AbortCode
from pneuforce.registers.canopen.entry import EntryAddress, ObjectEntry
from pneuforce.registers.canopen.measuring_device import AUTOZERO, AUTOZERO_SIGNATURE
from pneuforce.support.rejected_write import RejectedWrite

_VALUE_REJECTED = (AbortCode.TOO_LOW, AbortCode.TOO_HIGH, AbortCode.INVALID_VALUE)


def rejected_sdo(
    address: EntryAddress, raw: bytes, abort_code: AbortCode, entry: ObjectEntry | None
) -> RejectedWrite:
    """Return a rejected write by SDO in words. `entry` is None if the dictionary has no such entry."""
    index, subindex = address
    request = index.to_bytes(2, "little") + bytes((subindex,)) + raw
    written = f"object {index:04X}h:{subindex}, {_described(entry, raw)}"
    return RejectedWrite(request, abort_code.meaning, written.rstrip(", "), _allowed(entry, abort_code))


def _described(entry: ObjectEntry | None, raw: bytes) -> str:
    """Return the name of the entry and the written value. A value that cannot be decoded is hexadecimal."""
    if entry and entry.field and len(raw) == entry.type.size:
        return entry.field.describe(*struct.unpack(entry.type.layout, raw))
    value = f"{raw[::-1].hex()}h" if raw else ""
    return f"{_name(entry)} {value}".strip()


def _name(entry: ObjectEntry | None) -> str:
    if entry is None:
        return ""
    return entry.field.name if entry.field else entry.name


def _allowed(entry: ObjectEntry | None, abort_code: AbortCode) -> str:
    """Return what is allowed, or the remedy. Empty if the abort code says everything."""
    if entry is None:
        return "the objects are listed in canopen-objects.md"
    if entry.index == AUTOZERO:
        return f"write {AUTOZERO_SIGNATURE:08X}h to 6125h:2; the force has no zero adjustment"
    if entry.field and abort_code in _VALUE_REJECTED:
        return f"{_name(entry)} {entry.field.allowed_values}"
    if abort_code in (AbortCode.TOO_LONG, AbortCode.TOO_SHORT):
        return f"{_name(entry)} has {entry.type.size} bytes"
    return ""
