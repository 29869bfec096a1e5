"""Register map and CAN frames as a CSV table, for import into a PLC project or a spreadsheet."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator

from pneuforce.registers.can.frames import DEFAULT_NODE_ID, FRAMES, FrameDefinition
from pneuforce.registers.document_text import (
    HOLDING_REGISTERS,
    INPUT_REGISTERS,
    TYPE_NAMES,
    format_not_available,
    format_number,
)
from pneuforce.registers.field import Field
from pneuforce.registers.map import REGISTERS
from pneuforce.registers.map_hash import MAP_HASH

#: Modbus: `address` counts from 0 and `number` from 1. A register is both an input and a holding register.
#: CAN: `address` is the first byte within the frame. `map_hash` is the same in all rows.
COLUMNS = (
    "bus", "frame", "can_id", "address", "address_hex", "number", "input_register", "holding_register",
    "words", "name", "type", "unit", "low", "high", "also_allowed", "not_available", "values", "access",
    "meaning", "map_hash",
)  # fmt: skip


def render(node_id: int = DEFAULT_NODE_ID) -> str:
    """Return the table: one row for each register, then one for each field of the frames of the node."""
    text = io.StringIO()
    writer = csv.DictWriter(text, COLUMNS, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(_rows(node_id))
    return text.getvalue()


def _rows(node_id: int) -> Iterator[dict[str, str]]:
    for register in REGISTERS:
        yield _field_columns(register) | {
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
        for offset, field in frame.field_offsets:
            yield _field_columns(field) | _frame_columns(frame, offset, node_id)


def _frame_columns(frame: FrameDefinition, offset: int, node_id: int) -> dict[str, str]:
    return {
        "bus": "can",
        "frame": frame.name,
        "can_id": f"{frame.base_id + node_id:03X}",
        "address": str(offset),
        "access": "W" if frame.received else "R",
    }


def _field_columns(field: Field) -> dict[str, str]:
    return {
        "name": field.name,
        "type": TYPE_NAMES[field.wire],
        "unit": field.unit,
        "low": "" if field.low is None else format_number(field.low),
        "high": "" if field.high is None else format_number(field.high),
        "also_allowed": " ".join(format_number(value) for value in field.also_allowed),
        "not_available": format_not_available(field),
        "values": "; ".join(f"{code} {name}" for code, name in field.code_names.items()),
        "meaning": field.doc,
        "map_hash": str(MAP_HASH),
    }
