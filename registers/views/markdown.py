"""The register map and the CAN frames for people."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from registers.can.frames import COMMAND_MODES, DEFAULT_NODE_ID, FRAMES, NODE_STATES, RESULTS, Frame
from registers.codes import CONDENSED, STATUS
from registers.field import Bits, Field, Values
from registers.map import BLOCKS, MAP_HASH, MAP_VERSION, REGISTERS, Register
from registers.views.facts import (
    ENUMERATIONS,
    HOLDING_REGISTERS,
    INPUT_REGISTERS,
    TYPES,
    not_available_text,
    number,
    span_text,
)

_INTRODUCTION = f"""\
# Registers and frames

Map version {MAP_VERSION}, hash {MAP_HASH:08X}h (registers 768 and 770). This page is made from the
declaration that the instrument itself runs on: `pneuforce map --format md`.

## Modbus registers

One address space, 0-based, read by functions 03 and 04 alike; written (RW only) by 06, 16, 22 and 23. Many
programs count registers from 1: that number stands beside the address. Some add the kind of register to it:
force is {INPUT_REGISTERS + 1} as an input register (04), {HOLDING_REGISTERS + 1} as a holding register (03).
32-bit values have their high word first (ABCD; the configuration can turn it to CDAB). A read must lie within
one of the blocks
{", ".join(f"{a}–{b}" for a, b in BLOCKS)}; what is not listed there reads 0. *n/a* is the code of a
value that is not available; the status says why.

TCP port 5020 and unit id 1 unless configured otherwise; unit ids 0 and 255 mean this instrument too, any
other is answered with exception 0Bh. On a serial line (Modbus RTU, off by default; 19200 Bd, even parity and
unit id 1 unless configured otherwise) another unit is met with silence, and a broadcast can only vent. On
both, function 02 reads the status bits as discrete inputs 0–31; function
43/14 reads who it is (objects 0–6, serial number 80h, calibration date 81h).

| exception | when |
| --- | --- |
| 01 | a function that is not served, or a write in read-only mode |
| 02 | an address outside the blocks, a read across two of them, a write to what is not RW |
| 03 | a wrong quantity, a value out of its span, NaN, half of a 32-bit value written |
| 06 | refused for now; register 27 says why. Libraries call it *busy*: do not let them retry it blindly |

Nothing changes in any of these; only a vent (516 := 0) within a refused request is carried out all the same.
"""
_STATUS = """\
## Status bits

Register 20 (uint32), the Status frame, and the discrete inputs 0–31. A bit that latches stays until it is
cleared by command once its cause is gone; the others follow their cause. What to do at each of them, and at
each fault and refusal: [faults.md](faults.md).
"""
_FRAMES = """\
## CAN frames

Classic CAN, 11-bit identifiers, little-endian, node id N (default {node_id}). The same as a DBC:
`pneuforce map --format dbc`.
"""
_COMMAND = """\
A Command is judged in the order length, span, sequence. The same sequence with the same content renews the
lease and is not carried out again; the same sequence with other content is refused. A vent of full length is
carried out whatever its other fields and its sequence are.
"""


def render() -> str:
    """The page."""
    parts = [
        _INTRODUCTION,
        table(("address", "hex", "number", "name", "type", "unit", "span", "n/a", "access", "meaning"),
               map(_register_row, REGISTERS)),
        _STATUS,
        _bits(STATUS),
        "## Condensed status bits\n\nRegister 71 and the Force frame.\n",
        _bits(CONDENSED),
        "## Enumerations\n",
        *(_values(name, values) for name, values in ENUMERATIONS.items()),
        _FRAMES.format(node_id=DEFAULT_NODE_ID),
        *(_frame(frame) for frame in FRAMES),
        _COMMAND,
        _values("Command mode", COMMAND_MODES),
        _values("Answer result", RESULTS),
        _values("node state", NODE_STATES),
    ]  # fmt: skip
    return "\n".join(parts)


def _register_row(register: Register) -> Sequence[str]:
    return (
        str(register.address),
        f"{register.address:04X}h",
        str(register.address + 1),
        f"`{register.name}`",
        TYPES[register.wire],
        register.unit,
        span_text(register),
        not_available_text(register),
        "RW" if register.writable else "R",
        register.doc,
    )


def _bits(bits: Bits) -> str:
    return table(
        ("bit", "name", "latches", "meaning"),
        ((str(b.number), f"`{b.name}`", "latches" if b.latches else "", b.doc) for b in bits.bits),
    )


def _values(name: str, values: Values) -> str:
    listed = ", ".join(f"{code} {value}" for code, value in values.names.items())
    return f"- **{name}**: {listed}\n"


def _frame(frame: Frame) -> str:
    period = f", cycle {number(frame.period_s * 1e3)} ms" if frame.period_s else ""
    bytes_ = "1 byte" if frame.length == 1 else f"{frame.length} bytes"
    head = f"### {frame.name}: {frame.base_id:03X}h + N, {bytes_}{period}\n\n{frame.doc}\n"
    rows = (_field_row(at, field) for at, field in frame.placed)
    return f"{head}\n" + table(("byte", "name", "type", "unit", "span", "n/a", "meaning"), rows)


def _field_row(at: int, field: Field) -> Sequence[str]:
    last = at + field.wire.size - 1
    return (
        str(at) if last == at else f"{at}–{last}",
        f"`{field.name}`",
        TYPES[field.wire],
        field.unit,
        span_text(field),
        not_available_text(field),
        field.doc,
    )


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table, its head first."""
    lines = [head, ["---"] * len(head), *rows]
    return "".join(f"| {' | '.join(cells)} |\n" for cells in lines)
