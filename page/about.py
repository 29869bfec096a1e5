"""What stands still: the instrument's names, its map, and the words for what it says."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from registers.advice import FAULT_ADVICE, REFUSAL_WORDS, STATE_WORDS, STATUS_ADVICE
from registers.codes import FAULTS, STATUS
from registers.map import MAP_HASH, MAP_VERSION, REGISTERS, Register
from registers.views.facts import TYPES

_OWN = ("version", "configuration_hash", "serial_number", "simulated")


def about(begun: Mapping[str, Any], writable: bool) -> dict[str, Any]:
    """The facts that a browser asks for once; `begun` is what the instrument says of itself, if it did."""
    return {
        **{name: begun.get(name) for name in _OWN},
        "replay": begun.get("replay", ""),
        "map_version": MAP_VERSION,
        "map_hash": f"{MAP_HASH:08x}",
        "writable": writable,
        "registers": [_register(register) for register in REGISTERS],
        "faults": {code: {"name": FAULTS.names[code], **a._asdict()} for code, a in FAULT_ADVICE.items()},
        "status": {bit.name: {"bit": bit.number, **STATUS_ADVICE[bit.name]._asdict()} for bit in STATUS.bits},
        "refusals": dict(REFUSAL_WORDS),
        "states": dict(STATE_WORDS),
    }


def _register(register: Register) -> dict[str, Any]:
    return {
        "address": register.address,
        "words": register.wire.words,
        "name": register.name,
        "unit": register.unit,
        "always": register.always,
        "type": TYPES[register.wire],
        "doc": register.doc,
        "writable": register.writable,
        "low": register.low,
        "high": register.high,
        "codes": register.code_names,
        "bits": {bit.number: bit.name for bit in register.bits.bits} if register.bits else {},
    }
