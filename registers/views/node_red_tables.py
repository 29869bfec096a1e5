"""Tables of the Node-RED flow: addresses, registers, texts and times that its function nodes use."""

from __future__ import annotations

from typing import Any

from pneuforce.registers.advice import (
    FAULT_ADVICE,
    NO_FORCE_REASONS,
    REJECT_REASON_ADVICE,
    STATE_DESCRIPTIONS,
    STATUS_ADVICE,
)
from pneuforce.registers.codes import ANSWERS, COMMANDS, FAULTS, MODES, REJECT_REASONS, STATES, STATUS
from pneuforce.registers.document_text import MEASURED_BLOCK, TEST_BLOCK, TYPE_NAMES, name_with_unit
from pneuforce.registers.field import WireType
from pneuforce.registers.map import BY_NAME, COMMAND_KEY, MAP_VERSION, REGISTERS, Register
from pneuforce.registers.map_hash import MAP_HASH
from pneuforce.registers.modbus.register_bank import RegisterBank

TICK_MS = 250  #: interval of the reading cycles, in which all times of the flow are counted
LEASE_MS = 3000
_RENEWALS_PER_LEASE = 3
SETPOINT_KPA, FORCE_LIMIT_N = 8.0, 5.0  #: values before the first command
#: Registers that one cycle reads with one request each. The fault is read after the state.
_BLOCKS = {
    "measured": MEASURED_BLOCK,
    "answer": range(BY_NAME["answer_sequence"].address, BY_NAME["answer_result"].end),
    "identity": range(BY_NAME["map_version"].address, BY_NAME["inflation_count"].end),
    "test": TEST_BLOCK,
}
#: Status bits with which a force is never valid, even if the register contains a number.
_NEVER_VALID = ("stale", "link_lost", "failure")
#: Writable registers of the values that a command can set.
LIMITED = {"setpoint": "setpoint_requested", "force_limit": "force_limit"}

Table = dict[str, Any]


def read_tables() -> Table:
    """Return the tables of the function node that reads the instrument."""
    return {
        "maxCycleTicks": 2,
        "mapVersion": MAP_VERSION,
        "mapHash": MAP_HASH,
        "blocks": {name: {"address": block.start, "quantity": len(block)} for name, block in _BLOCKS.items()},
        "testWords": {"ABCD": _test_words(RegisterBank()), "CDAB": _test_words(RegisterBank(word_swap=True))},
        "registers": [
            _location(register, name, block)
            for name, block in _BLOCKS.items()
            for register in REGISTERS
            if register.address in block and block is not TEST_BLOCK
        ],
        "forces": [name_with_unit(BY_NAME[f"force{end}"]) for end in ("", "_uncertainty", "_uncompensated")],
        "statusBits": [{"bit": bit.number, "name": bit.name} for bit in STATUS.bits],
        "neverValid": _NEVER_VALID,
        "noForce": {name: STATUS_ADVICE[name].what for name in NO_FORCE_REASONS},
        "states": STATES.names,
        "stateTexts": {code: STATE_DESCRIPTIONS[name] for code, name in STATES.names.items()},
        "advice": {name: advice.do for name, advice in STATUS_ADVICE.items() if advice.do},
        "faults": {
            code: {"name": name, "what": FAULT_ADVICE[code].what, "remedy": FAULT_ADVICE[code].do}
            for code, name in FAULTS.names.items()
            if code
        },
        "unknownFault": {
            "name": "unknown",
            "what": "The board is newer than this flow.",
            "remedy": "See docs/faults.md of the installed version.",
        },
    }


def control_tables() -> Table:
    """Return the tables of the function node that holds the balloon and clears faults."""
    return {
        "address": _addresses(
            lease="lease", mode="mode", command="command_key", setpoint="setpoint_requested",
            force_limit="force_limit",
        ),
        "limits": {
            name: {"low": BY_NAME[full].low, "high": BY_NAME[full].high, "unit": BY_NAME[full].unit}
            for name, full in LIMITED.items()
        },
        **MODES.codes,
        "done": ANSWERS.codes["done"],
        "commandKey": COMMAND_KEY,
        "clearFaults": COMMANDS.codes["clear_faults"],
        "rejectReasons": {code: REJECT_REASON_ADVICE[name] for code, name in REJECT_REASONS.names.items()},
        "leaseMs": LEASE_MS,
        "leaseTicks": LEASE_MS // TICK_MS,
        "renewTicks": LEASE_MS // TICK_MS // _RENEWALS_PER_LEASE,
        "answerTicks": _ticks(2.0),
        "cycleTicks": 2,
        "startTicks": _ticks(1.0),
        "stepTicks": {
            "emptying": _ticks(10.0), "inflating": _ticks(20.0), "clearing": _ticks(3.0),
            "rejected": _ticks(2.0),
        },
        "leased": ["vent", "emptying", "request", "inflating", "holding"],
        "notInflated": ["boot", "vented", "venting"],
    }  # fmt: skip


def vent_tables() -> Table:
    """Return the tables of the function node that vents."""
    return {"address": _addresses(mode="mode", lease="lease"), "repeatTicks": _ticks(0.75)}


READ_STATE: Table = {"cycle": 0, "ticks": 0, "words": {}, "waiting": []}
VENT_STATE: Table = {"step": "", "request": 0, "ticks": 0}
CONTROL_STATE: Table = {
    "step": "idle",
    "ticks": 0,
    "readingTicks": LEASE_MS // TICK_MS,
    "renewTicks": 0,
    "pending": None,
    "due": [],
    "retry": [],
    "request": 0,
    "venting": False,
    "reading": None,
    "values": {"setpoint": SETPOINT_KPA, "force_limit": FORCE_LIMIT_N},
}


def _ticks(time_s: float) -> int:
    return round(time_s * 1000 / TICK_MS)


def _addresses(**names: str) -> dict[str, int]:
    return {key: BY_NAME[name].address for key, name in names.items()}


def _test_words(bank: RegisterBank) -> list[int]:
    tests = [register for register in REGISTERS if register.address in TEST_BLOCK]
    data = b"".join(bank.encode_words(register, register.constant or 0) for register in tests)
    return [int.from_bytes(data[at : at + 2], "big") for at in range(0, len(data), 2)]


def _location(register: Register, block: str, addresses: range) -> Table:
    """Return the place of a register in the words of its block, and its not-available code."""
    location = {
        "name": name_with_unit(register),
        "block": block,
        "index": register.address - addresses.start,
        "type": TYPE_NAMES[register.wire],
    }
    if register.not_available is not None and register.wire is not WireType.F32:
        location["missing"] = register.not_available
    return location
