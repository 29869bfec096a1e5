"""The register map and the CAN frames for programs."""

from __future__ import annotations

import json
from typing import Any

from registers.can.frames import COMMAND_MODES, DEFAULT_NODE_ID, FRAMES, NODE_STATES, RESULTS, Frame
from registers.codes import CONDENSED, STATUS
from registers.field import Bits, Field
from registers.map import BLOCKS, MAP_HASH, MAP_VERSION, REGISTERS
from registers.views.facts import ENUMERATIONS, TYPES, not_available_text


def render() -> str:
    """The tree."""
    tree = {
        "map_version": MAP_VERSION,
        "map_hash": MAP_HASH,
        "word_order": "ABCD",
        "blocks": BLOCKS,
        "registers": [
            {"address": r.address, "number": r.address + 1, "words": r.wire.words, "writable": r.writable}
            | _facts(r)
            for r in REGISTERS
        ],
        "status_bits": _bits(STATUS),
        "condensed_status_bits": _bits(CONDENSED),
        "enumerations": {name: values.names for name, values in ENUMERATIONS.items()},
        "can": {
            "default_node_id": DEFAULT_NODE_ID,
            "byte_order": "little",
            "command_modes": COMMAND_MODES.names,
            "results": RESULTS.names,
            "node_states": NODE_STATES.names,
            "frames": [_frame(frame) for frame in FRAMES],
        },
    }
    return json.dumps(tree, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def _facts(field: Field) -> dict[str, Any]:
    facts = {
        "name": field.name,
        "type": TYPES[field.wire],
        "unit": field.unit or None,
        "low": field.low,
        "high": field.high,
        "also": list(field.also) or None,
        "constant": field.constant,
        "not_available": not_available_text(field) or None,
        "values": field.code_names or None,
        "bits": {bit.name: bit.number for bit in field.bits.bits} if field.bits else None,
        "meaning": field.doc,
    }
    return {key: value for key, value in facts.items() if value is not None}


def _bits(bits: Bits) -> list[dict[str, Any]]:
    return [{"bit": b.number, "name": b.name, "latches": b.latches, "meaning": b.doc} for b in bits.bits]


def _frame(frame: Frame) -> dict[str, Any]:
    return {
        "name": frame.name,
        "base_id": frame.base_id,
        "length": frame.length,
        "period_s": frame.period_s or None,
        "received": frame.received,
        "meaning": frame.doc,
        "fields": [{"byte": at} | _facts(field) for at, field in frame.placed],
    }
