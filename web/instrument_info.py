"""Static facts about the instrument for the browsers: identity, register map and meaning of all codes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pneuforce.registers.advice import (
    FAULT_ADVICE,
    STATE_DESCRIPTIONS,
    STATUS_ADVICE,
)
from pneuforce.registers.codes import FAULTS, STATES, STATUS
from pneuforce.registers.document_text import TYPE_NAMES
from pneuforce.registers.map import MAP_VERSION, REGISTERS, Register
from pneuforce.registers.map_hash import MAP_HASH
from pneuforce.web.operator_texts import (
    FAULT_TITLES,
    MAINTENANCE_TEXTS,
    REJECT_TEXTS,
    STATUS_ACTIONS,
    in_page_words,
)

#: State of the board during a proof test. The state register shows "holding".
PROOF_TEST_STATE = 7
_IDENTITY = ("version", "configuration_hash", "signatures", "serial_number", "simulated")


def instrument_info(header: Mapping[str, Any]) -> dict[str, Any]:
    """Return the facts that a browser requests once per connection, as JSON values.

    `header` is the stream header of the instrument. Before the instrument is reached, the header is empty and
    the identity is null.
    """
    return {
        **{name: header.get(name) for name in _IDENTITY},
        "replay": header.get("replay", ""),
        "force_range_kpa": header.get("force_range_kpa"),
        "map_version": MAP_VERSION,
        "map_hash": f"{MAP_HASH:08x}",
        "registers": [_register(register) for register in REGISTERS],
        "faults": {code: _fault(code) for code in FAULT_TITLES},
        "status": {bit.name: _status_bit(bit.number, bit.name) for bit in STATUS.bits},
        "maintenance": dict(MAINTENANCE_TEXTS),
        "reject_reasons": dict(REJECT_TEXTS),
        "states": {name: in_page_words(text) for name, text in STATE_DESCRIPTIONS.items()},
        "board_states": dict(STATES.names) | {PROOF_TEST_STATE: "proof_test"},
    }


def _fault(code: int) -> dict[str, str]:
    advice = FAULT_ADVICE[code]
    return {
        "name": FAULTS.names[code],
        "title": FAULT_TITLES[code],
        "meaning": in_page_words(advice.what),
        "action": in_page_words(advice.do),
    }


def _status_bit(number: int, name: str) -> dict[str, Any]:
    return {"bit": number, "meaning": in_page_words(STATUS_ADVICE[name].what), "action": STATUS_ACTIONS[name]}


def _register(register: Register) -> dict[str, Any]:
    return {
        "address": register.address,
        "words": register.wire.words,
        "name": register.name,
        "unit": register.unit,
        "always_available": register.always_available,
        "type": TYPE_NAMES[register.wire],
        "doc": register.doc,
        "writable": register.writable,
        "low": register.low,
        "high": register.high,
        "codes": register.code_names,
        "bits": {bit.number: bit.name for bit in register.bits.bits} if register.bits else {},
    }
