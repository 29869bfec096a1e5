"""The register map and the CAN frames as one table, for import into a PLC project or a spreadsheet."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator

from registers.can.frames import DEFAULT_NODE_ID, FRAMES, Frame
from registers.field import Field
from registers.map import REGISTERS
from registers.views.facts import HOLDING_REGISTERS, INPUT_REGISTERS, TYPES, not_available_text, number

#: Modbus: address is 0-based, number counts from 1, and the same register is an input and a holding register.
#: CAN: address is the first byte within the frame.
COLUMNS = (
    "bus", "frame", "can_id", "address", "address_hex", "number", "input_register", "holding_register",
    "words", "name", "type", "unit", "low", "high", "also", "not_available", "values", "access", "meaning",
)  # fmt: skip


def render() -> str:
    """The table: registers first, then each field of each frame at the default node id."""
    text = io.StringIO()
    writer = csv.DictWriter(text, COLUMNS, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(_rows())
    return text.getvalue()


def _rows() -> Iterator[dict[str, str]]:
    for register in REGISTERS:
        yield _facts(register) | {
            "bus": "modbus",
            "address": str(register.address),
            "address_hex": f"{register.address:04X}",
            "number": str(register.address + 1),
            "input_register": str(INPUT_REGISTERS + register.address + 1),
            "holding_register": str(HOLDING_REGISTERS + register.address + 1),
            "words": str(register.wire.words),
            "access": "RW" if register.writable else "R",
        }
    for frame in FRAMES:
        for at, field in frame.placed:
            yield _facts(field) | _place(frame, at)


def _place(frame: Frame, at: int) -> dict[str, str]:
    return {
        "bus": "can",
        "frame": frame.name,
        "can_id": f"{frame.base_id + DEFAULT_NODE_ID:03X}",
        "address": str(at),
        "access": "W" if frame.received else "R",
    }


def _facts(field: Field) -> dict[str, str]:
    return {
        "name": field.name,
        "type": TYPES[field.wire],
        "unit": field.unit,
        "low": "" if field.low is None else number(field.low),
        "high": "" if field.high is None else number(field.high),
        "also": " ".join(number(value) for value in field.also),
        "not_available": not_available_text(field),
        "values": "; ".join(f"{code} {name}" for code, name in field.code_names.items()),
        "meaning": field.doc,
    }
