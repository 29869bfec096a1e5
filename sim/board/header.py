"""The board's numbers and tables as a C header: `python -m sim.board.header` writes the firmware's."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator
from enum import IntEnum, IntFlag
from pathlib import Path
from textwrap import wrap
from types import ModuleType

from instrument.rig import frames
from instrument.rig import limits as promised
from instrument.rig.frames import KINDS, BoardKind, BoardState, CommandFlag, Fault, Message, Mode, Valve
from instrument.rig.limits import PRESSURISED
from sim.board import board, filling, limits, pressure, reading, situation, states, supply, watches
from sim.board.limits import GONE, LIMITS
from sim.board.states import FILLING, TRANSITIONS, Happening

HEADER = Path("firmware/pneuforce/numbers.h")
#: Every number that these name in capitals becomes a macro of the same name; seconds become milliseconds.
MODULES = (frames, promised, states, reading, supply, filling, watches, situation, limits, pressure, board)
ENUMS: dict[str, type[IntEnum] | type[IntFlag]] = {
    "BOARD": BoardKind,
    "STATE": BoardState,
    "FAULT": Fault,
    "MODE": Mode,
    "VALVE": Valve,
    "FLAG": CommandFlag,
}
C_TYPES = {"B": "uint8_t", "H": "uint16_t", "h": "int16_t", "I": "uint32_t"}


def literal(name: str, value: float) -> tuple[str, str]:
    """Name and value in C: times in milliseconds, so that they add up without rounding."""
    if name.endswith("_S") and not name.endswith("_PER_S"):
        milliseconds = round(value * 1e3)
        if not math.isclose(milliseconds, value * 1e3):
            raise ValueError(f"{name} is {value:g} s, and must be whole milliseconds")
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
            yield literal(f"{name}_LEAST", low)
            yield literal(f"{name}_MOST", high)


def _numbers() -> Iterator[str]:
    told: dict[str, str] = {}
    for module in MODULES:
        new = {name: value for name, value in _numbers_of(module) if told.get(name) != value}
        if again := new.keys() & told.keys():
            raise ValueError(f"{module.__name__} gives another value to {', '.join(again)}")
        told |= new
        if new:
            yield f"\n/* {module.__name__} */"
            yield from (f"#define {name} {value}" for name, value in new.items())


def _enums() -> Iterator[str]:
    yield "\n/* What the bytes of the frames mean. */"
    for prefix, members in ENUMS.items():
        yield from _enum(f"{prefix}_{m.name} = {m.value}" for m in members if m.name)
    yield from _enum([*(f"HAPPENS_{h.name}" for h in Happening), "HAPPENINGS", "NOTHING_HAPPENS"])


def _enum(members: Iterable[str]) -> Iterator[str]:
    yield "enum {"
    yield from wrap(", ".join(members), 110, initial_indent="    ", subsequent_indent="    ")
    yield "};"


def _message(message: type[Message]) -> Iterator[str]:
    """Payloads are packed and little-endian, as the AVR's own numbers are."""
    name = message.__name__.lower()
    yield f"#define KIND_{name.upper()} 0x{message.kind:02X}u"
    if not message.__slots__:
        return
    yield f"struct {name} {{"
    for field, code in zip(message.__slots__, re.sub("[^BHhI]", "", message.layout.format), strict=True):
        yield f"    {C_TYPES[code]} {field};"
    yield "} __attribute__((packed));"


def _mask(of: Iterable[IntEnum]) -> str:
    return f"0x{sum(1 << member for member in of):02X}u"


def _rows(name: str, rows: Iterable[str]) -> Iterator[str]:
    yield f"#define {name}(ROW) \\"
    yield " \\\n".join(f"    ROW({row})" for row in rows)


def _tables() -> Iterator[str]:
    yield "\n/* sim.board.states: what follows on each happening (columns) in each state (rows). */"
    yield f"#define STATES {len(BoardState)}"
    yield "#define STAYS 0xFFu"
    follow = {s: [TRANSITIONS[s].get(h) for h in Happening] for s in BoardState}
    names = {s: ", ".join("STAYS" if f is None else f"STATE_{f.name}" for f in follow[s]) for s in follow}
    yield "#define TRANSITION_ROWS { \\"
    yield ", \\\n".join(f"    {{ {row} }}" for row in names.values()) + " }"
    yield f"#define FILLING_STATES {_mask(FILLING)}"
    yield f"#define PRESSURISED_STATES {_mask(PRESSURISED)}"
    yield "\n/* sim.board.limits: fault, mask of states, samples in a row, what is allowed. */"
    yield f"#define LIMIT_COUNT {len(LIMITS)}"
    limits_in_c = (
        f"FAULT_{limit.fault.name}, {_mask(limit.states)}, {limit.samples}, {limit.allowed.__name__}"
        for limit in LIMITS
    )
    yield from _rows("LIMIT_ROWS", limits_in_c)
    yield "\n/* When a latched fault may be cleared. */"
    yield from _rows("GONE_ROWS", (f"FAULT_{fault.name}, {gone.__name__}" for fault, gone in GONE.items()))


def render() -> str:
    """The header."""
    lines = [
        "/* The numbers and tables that the boards in C and in Python share.",
        " * Made from sim/board and instrument/rig by `make docs`: do not edit. */",
        "#ifndef NUMBERS_H",
        "#define NUMBERS_H",
        "",
        "#include <stdint.h>",
        *_numbers(),
        *(f"#define SYNC_{n} 0x{byte:02X}u" for n, byte in enumerate(frames.SYNC)),
        *_enums(),
        "\n/* instrument.rig.frames: payloads. */",
        *(line for message in KINDS.values() for line in _message(message)),
        *_tables(),
        "\n#endif",
    ]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    HEADER.write_text(render(), encoding="utf-8")
    print(HEADER)
