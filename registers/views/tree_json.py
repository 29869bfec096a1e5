"""Register map and CAN frames as JSON, for programs."""

from __future__ import annotations

import json
from typing import Any

from pneuforce.registers.can.frames import (
    COMMAND_MODES,
    DEFAULT_NODE_ID,
    FRAMES,
    NODE_STATES,
    RESULTS,
    FrameDefinition,
)
from pneuforce.registers.codes import CONDENSED, MAINTENANCE_CAUSES, STATUS
from pneuforce.registers.document_text import ENUMERATIONS, TYPE_NAMES, format_not_available
from pneuforce.registers.field import BitField, Field
from pneuforce.registers.map import BLOCKS, MAP_VERSION, REGISTERS
from pneuforce.registers.map_hash import MAP_HASH


def render() -> str:
    """Return the JSON text."""
    return json.dumps(tree(), indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def tree() -> dict[str, Any]:
    """Return the content of the JSON text. The page map_files_page describes its keys."""
    return {
        "map_version": MAP_VERSION,
        "map_hash": MAP_HASH,
        "word_order": "ABCD",
        "blocks": BLOCKS,
        "registers": [
            {"address": r.address, "number": r.address + 1, "words": r.wire.words, "writable": r.writable}
            | _field(r)
            for r in REGISTERS
        ],
        "status_bits": _bits(STATUS),
        "condensed_status_bits": _bits(CONDENSED),
        "maintenance_cause_bits": _bits(MAINTENANCE_CAUSES),
        "enumerations": {_identifier(name): values.names for name, values in ENUMERATIONS.items()},
        "can": {
            "default_node_id": DEFAULT_NODE_ID,
            "byte_order": "little",
            "command_modes": COMMAND_MODES.names,
            "results": RESULTS.names,
            "node_states": NODE_STATES.names,
            "frames": [_frame(frame) for frame in FRAMES],
        },
    }


def _field(field: Field) -> dict[str, Any]:
    entries = {
        "name": field.name,
        "type": TYPE_NAMES[field.wire],
        "unit": field.unit or None,
        "low": field.low,
        "high": field.high,
        "also_allowed": list(field.also_allowed) or None,
        "constant": field.constant,
        "not_available": format_not_available(field) or None,
        "values": field.code_names or None,
        "enumeration": next(
            (_identifier(n) for n, e in ENUMERATIONS.items() if e is (field.values or field.legend)), None
        ),
        "bits": {bit.name: bit.number for bit in field.bits.bits} if field.bits else None,
        "meaning": field.doc,
    }
    return {key: value for key, value in entries.items() if value is not None}


def _identifier(name: str) -> str:
    return name.replace(" ", "_")


def _bits(bits: BitField) -> list[dict[str, Any]]:
    return [{"bit": b.number, "name": b.name, "latches": b.latches, "meaning": b.doc} for b in bits.bits]


def _frame(frame: FrameDefinition) -> dict[str, Any]:
    return {
        "name": frame.name,
        "base_id": frame.base_id,
        "length": frame.length,
        "period_s": frame.period_s or None,
        "received": frame.received,
        "meaning": frame.doc,
        "fields": [{"byte": offset} | _field(field) for offset, field in frame.field_offsets],
    }
