"""Register map and CAN frames as a CSV table, for import into a PLC project or a spreadsheet."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping

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

#: Columns and their meanings. A register is both an input and a holding register.
COLUMNS: Mapping[str, str] = {
    "bus": "`modbus` or `can`",
    "frame": "CAN: name of the frame",
    "can_id": "CAN: identifier of the frame for the node id, hexadecimal",
    "address": "Modbus: address of the first word, from 0. CAN: first byte of the field within the frame",
    "address_hex": "Modbus: the address, hexadecimal with four digits",
    "number": "Modbus: address + 1, for programs that count from 1",
    "input_register": "Modbus: number from 30001, for function 04",
    "holding_register": "Modbus: number from 40001, for function 03",
    "words": "Modbus: number of 16-bit words",
    "name": "name of the value",
    "type": "`float32`, `uint32`, `int32`, `uint16`, `int16` or `uint8`",
    "unit": "unit of the number on the wire, for example `mN`; empty for a number without unit",
    "low": "smallest accepted or meaningful value, in `unit`",
    "high": "largest accepted or meaningful value, in `unit`",
    "also_allowed": "accepted values outside `low` to `high`, separated by spaces",
    "not_available": "code of a value that is not available: `NaN`, or hexadecimal as `7FFFh`; empty if "
    "the field always has a value",
    "values": "codes of an enumeration as `0 idle; 1 busy`",
    "access": "Modbus: `R` or `RW`. CAN: `R` for frames that the instrument sends, `W` for the frame Command",
    "meaning": "description in one or two sentences",
    "map_hash": "map hash, decimal, the same in each row",
}


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
