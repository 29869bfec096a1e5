"""Generator of the C header that shares the numbers and tables of the Python board with the firmware.

`python -m pneuforce.sim.board.header` writes firmware/pneuforce/numbers.h.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator
from enum import IntEnum, IntFlag
from pathlib import Path
from textwrap import wrap
from types import ModuleType

from pneuforce.protocol import frames
from pneuforce.protocol import limits as protocol_limits
from pneuforce.protocol.frames import KINDS, BoardKind, BoardState, CommandFlag, Fault, Message, Mode, Valve
from pneuforce.protocol.limits import PRESSURISED
from pneuforce.sim.board import (
    board,
    board_status,
    filling,
    limits,
    monitors,
    pressure_control,
    proof_test,
    reading,
    states,
    supply,
)
from pneuforce.sim.board.limits import CLEAR_CONDITIONS, LIMITS
from pneuforce.sim.board.states import FILLING, TRANSITIONS, Trigger

HEADER = Path("firmware/pneuforce/numbers.h")
#: Every numeric constant of these modules becomes a macro of the same name. Seconds become milliseconds.
MODULES = (
    frames,
    protocol_limits,
    states,
    reading,
    supply,
    filling,
    monitors,
    proof_test,
    board_status,
    limits,
    pressure_control,
    board,
)
ENUMS: dict[str, type[IntEnum] | type[IntFlag]] = {
    "BOARD": BoardKind,
    "STATE": BoardState,
    "FAULT": Fault,
    "MODE": Mode,
    "VALVE": Valve,
    "FLAG": CommandFlag,
}
NO_BREAK_SPACE = "\N{NO-BREAK SPACE}"
C_TYPES = {"B": "uint8_t", "H": "uint16_t", "h": "int16_t", "I": "uint32_t"}


def literal(name: str, value: float) -> tuple[str, str]:
    """Return name and value of a macro. Times are whole milliseconds, so that their sums are exact.

    Raises ValueError if a time is not a whole number of milliseconds.
    """
    if name.endswith("_S") and not name.endswith("_PER_S"):
        milliseconds = round(value * 1e3)
        if not math.isclose(milliseconds, value * 1e3):
            raise ValueError(f"{name} is {value:g} s, which is not a whole number of milliseconds: round it")
        return f"{name[:-2]}_MS", f"{milliseconds}u"
    return name, f"{value}u" if isinstance(value, int) else f"{value!r}f"


def _numbers_of(module: ModuleType) -> Iterator[tuple[str, str]]:
    for name, value in vars(module).items():
        if not re.fullmatch(r"[A-Z][A-Z0-9_]+", name):
            continue
        if type(value) in (int, float):
            yield literal(name, value)
        elif isinstance(value, tuple) and len(value) == 2 and {type(v) for v in value} <= {int, float}:
            low, high = (math.ceil(value[0]), math.floor(value[1])) if name.endswith("_SUM") else value
            yield literal(f"MIN_{name}", low)
            yield literal(f"MAX_{name}", high)


def _numbers() -> Iterator[str]:
    written: dict[str, str] = {}
    for module in MODULES:
        new = {name: value for name, value in _numbers_of(module) if written.get(name) != value}
        if conflicts := new.keys() & written.keys():
            raise ValueError(
                f"{module.__name__} redefines {', '.join(conflicts)} with another value: rename it"
            )
        written |= new
        if new:
            yield f"\n/* {module.__name__} */"
            yield from (f"#define {name} {value}" for name, value in new.items())


def _enums() -> Iterator[str]:
    yield "\n/* Values of the bytes in the frames, and triggers of state transitions. */"
    for prefix, members in ENUMS.items():
        yield from _enum(f"{prefix}_{m.name} = {m.value}" for m in members if m.name)
    yield from _enum([*(f"TRIGGER_{trigger.name}" for trigger in Trigger), "TRIGGER_COUNT", "NO_TRIGGER"])


def _enum(members: Iterable[str]) -> Iterator[str]:
    yield "enum {"
    unbroken = ", ".join(member.replace(" ", NO_BREAK_SPACE) for member in members)
    for line in wrap(unbroken, 110, initial_indent="    ", subsequent_indent="    "):
        yield line.replace(NO_BREAK_SPACE, " ")
    yield "};"


def _message(message: type[Message]) -> Iterator[str]:
    """Yield a packed C struct for the payload of a message. Payloads and AVR integers are little-endian."""
    name = message.__name__.lower()
    yield f"#define KIND_{name.upper()} 0x{message.kind:02X}u"
    if not message.__slots__:
        return
    yield f"struct {name} {{"
    for field, code in zip(message.__slots__, re.sub("[^BHhI]", "", message.layout.format), strict=True):
        yield f"    {C_TYPES[code]} {field};"
    yield "} __attribute__((packed));"


def _mask(members: Iterable[IntEnum]) -> str:
    return f"0x{sum(1 << member for member in members):02X}u"


def _rows(name: str, rows: Iterable[str]) -> Iterator[str]:
    yield f"#define {name}(ROW) \\"
    yield " \\\n".join(f"    ROW({row})" for row in rows)


def _tables() -> Iterator[str]:
    yield "\n/* pneuforce.sim.board.states: next state for each state (rows) and trigger (columns). */"
    yield f"#define STATE_COUNT {len(BoardState)}"
    yield "#define STAYS 0xFFu"
    next_states = [[TRANSITIONS[state].get(trigger) for trigger in Trigger] for state in BoardState]
    rows = [", ".join("STAYS" if s is None else f"STATE_{s.name}" for s in row) for row in next_states]
    yield "#define TRANSITION_ROWS { \\"
    yield ", \\\n".join(f"    {{ {row} }}" for row in rows) + " }"
    yield f"#define FILLING_STATES {_mask(FILLING)}"
    yield f"#define PRESSURISED_STATES {_mask(PRESSURISED)}"
    yield "\n/* pneuforce.sim.board.limits: fault, mask of states, samples in a row, condition. */"
    yield f"#define LIMIT_COUNT {len(LIMITS)}"
    limits_in_c = (
        f"FAULT_{limit.fault.name}, {_mask(limit.states)}, {limit.samples}, {limit.condition.__name__}"
        for limit in LIMITS
    )
    yield from _rows("LIMIT_ROWS", limits_in_c)
    yield "\n/* Condition under which a latched fault may be cleared. */"
    yield from _rows(
        "CLEAR_CONDITION_ROWS",
        (f"FAULT_{fault.name}, {condition.__name__}" for fault, condition in CLEAR_CONDITIONS.items()),
    )


def render() -> str:
    """Return the text of the header."""
    lines = [
        "/* Numbers and tables that the firmware and the Python board share.",
        " * Generated from sim/board and protocol by `make docs`: do not edit. */",
        "#ifndef NUMBERS_H",
        "#define NUMBERS_H",
        "",
        "#include <stdint.h>",
        *_numbers(),
        *(f"#define SYNC_{n} 0x{byte:02X}u" for n, byte in enumerate(frames.SYNC)),
        *_enums(),
        "\n/* pneuforce.protocol.frames: payloads. */",
        *(line for message in KINDS.values() for line in _message(message)),
        *_tables(),
        "\n#endif",
    ]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    HEADER.write_text(render(), encoding="utf-8")
    print(HEADER)
