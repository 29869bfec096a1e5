"""Register map and CAN frames as a Markdown page: docs/registers.md."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from pneuforce.registers.can.frames import (
    COMMAND_MODES,
    DEFAULT_NODE_ID,
    FRAMES,
    NODE_STATES,
    RESULTS,
    FrameDefinition,
)
from pneuforce.registers.codes import CONDENSED, STATUS
from pneuforce.registers.document_text import (
    ENUMERATIONS,
    HOLDING_REGISTERS,
    INPUT_REGISTERS,
    TYPE_NAMES,
    format_not_available,
    format_number,
    format_range,
)
from pneuforce.registers.field import BitField, Enumeration, Field
from pneuforce.registers.map import BLOCKS, MAP_HASH, MAP_VERSION, REGISTERS, Register

_INTRODUCTION = f"""\
# Registers and frames

Map version {MAP_VERSION}, hash {MAP_HASH:08X}h (registers 768 and 770). This page is generated from the
declaration that the instrument itself uses: `pneuforce map --format md`.

## Modbus registers

- **Addresses** start at 0, as on the wire. Many programs count registers from 1: see the column *number*.
  Some programs also add {INPUT_REGISTERS} to the number of an input register (function 04), and
  {HOLDING_REGISTERS} to the number of a holding register (function 03). Then force is
  {INPUT_REGISTERS + 1} or {HOLDING_REGISTERS + 1}.
- **Functions**: Functions 03 and 04 read the same registers. Functions 06, 16, 22 and 23 write the registers
  with access RW. Function 02 reads the status bits as discrete inputs 0–31. Function 43/14 reads the
  identification: objects 0–6, serial number (80h) and calibration date (81h).
- **Word order**: 32-bit values have their high word first (ABCD). The configuration can change this to CDAB.
- **Blocks**: a read must lie within one of the blocks {", ".join(f"{a}–{b}" for a, b in BLOCKS)}.
  Addresses in a block that are not listed here read 0.
- **n/a** is the code for "not available". The status bits show the reason.
- **TCP**: port 5020 and unit id 1 by default. Unit ids 0 and 255 also address this instrument. Other unit
  ids are answered with exception 0Bh.
- **Serial line** (Modbus RTU): disabled by default; 19200 Bd, even parity and unit id 1 by default. Requests
  to other units are not answered. A broadcast can only vent.

| exception | meaning |
| --- | --- |
| 01 | an unsupported function, or a write in read-only mode |
| 02 | an address outside the blocks, a read across two blocks, or a write to a register that is not RW |
| 03 | a wrong quantity, a value out of range, NaN, or only half of a 32-bit value written |
| 06 | rejected in the present state; register 27 shows the reason |

Libraries call exception 06 *busy*. Disable automatic repetition of the request.

A request that is answered with an exception changes nothing, but a vent (516 := 0) in such a request is still
carried out.
"""
_STATUS = """\
## Status bits

Register 20 (uint32), the Status frame, and the discrete inputs 0–31. A bit that *latches* stays set until a
command clears it, even if its cause is gone. Any other bit is set only while its cause is present. The page
[faults.md](faults.md) describes the action for each bit, fault and reject reason.
"""
_FRAMES = """\
## CAN frames

Classic CAN with 11-bit identifiers, little-endian, node id N (default {node_id}). The command
`pneuforce map --format dbc` prints the frames as a DBC file.
"""
_COMMAND = """\
The length, the ranges and the sequence of a Command are checked in this order. A Command with the same
sequence and the same content renews the lease and is not carried out again. A Command with the same sequence
and other content is rejected. A vent of full length is always carried out, even if other fields are invalid.
"""


def render() -> str:
    """Return the page."""
    register_columns = (
        "address", "hex", "number", "name", "type", "unit", "range", "n/a", "access", "meaning"
    )  # fmt: skip
    parts = [
        _INTRODUCTION,
        table(register_columns, map(_register_row, REGISTERS)),
        _STATUS,
        _bits(STATUS),
        "## Condensed status bits\n\nRegister 71 and the Force frame.\n",
        _bits(CONDENSED),
        "## Enumerations\n",
        *(_enumeration(name, values) for name, values in ENUMERATIONS.items()),
        _FRAMES.format(node_id=DEFAULT_NODE_ID),
        *(_frame(frame) for frame in FRAMES),
        _COMMAND,
        _enumeration("Command mode", COMMAND_MODES),
        _enumeration("Answer result", RESULTS),
        _enumeration("node state", NODE_STATES),
    ]
    return "\n".join(parts)


def _register_row(register: Register) -> Sequence[str]:
    return (
        str(register.address),
        f"{register.address:04X}h",
        str(register.address + 1),
        f"`{register.name}`",
        TYPE_NAMES[register.wire],
        register.unit,
        format_range(register),
        format_not_available(register),
        "RW" if register.writable else "R",
        register.doc,
    )


def _bits(bits: BitField) -> str:
    return table(
        ("bit", "name", "latches", "meaning"),
        ((str(b.number), f"`{b.name}`", "latches" if b.latches else "", b.doc) for b in bits.bits),
    )


def _enumeration(name: str, values: Enumeration) -> str:
    listed = ", ".join(f"{code} {value}" for code, value in values.names.items())
    return f"- **{name}**: {listed}\n"


def _frame(frame: FrameDefinition) -> str:
    period = f", cycle {format_number(frame.period_s * 1e3)} ms" if frame.period_s else ""
    bytes_ = "1 byte" if frame.length == 1 else f"{frame.length} bytes"
    head = f"### {frame.name}: {frame.base_id:03X}h + N, {bytes_}{period}\n\n{frame.doc}\n"
    rows = (_field_row(offset, field) for offset, field in frame.field_offsets)
    return f"{head}\n" + table(("byte", "name", "type", "unit", "range", "n/a", "meaning"), rows)


def _field_row(offset: int, field: Field) -> Sequence[str]:
    last = offset + field.wire.size - 1
    return (
        str(offset) if last == offset else f"{offset}–{last}",
        f"`{field.name}`",
        TYPE_NAMES[field.wire],
        field.unit,
        format_range(field),
        format_not_available(field),
        field.doc,
    )


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table with the column names `head`."""
    lines = [head, ["---"] * len(head), *rows]
    return "".join(f"| {' | '.join(cells)} |\n" for cells in lines)
