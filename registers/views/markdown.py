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
from pneuforce.registers.codes import CONDENSED, MAINTENANCE_CAUSES, STATUS
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
from pneuforce.registers.map import BLOCKS, MAP_VERSION, REGISTERS, Register
from pneuforce.registers.map_hash import MAP_HASH

_INTRODUCTION = f"""\
# Registers and frames

This page describes version {MAP_VERSION} of the register map, with the hash {MAP_HASH:08X}h. Registers 768
and 770 contain these two numbers. The command `pneuforce map --format md` generates this page from the
register map in the program of the instrument.

## Modbus registers

- **Addresses** start at 0, as in the Modbus frames. Many programs count registers from 1. For these programs,
  the table has the column *number*. Some programs also add {INPUT_REGISTERS} to the number of an input
  register (function 04), and {HOLDING_REGISTERS} to the number of a holding register (function 03). In these
  programs, the register `force` has the number {INPUT_REGISTERS + 1} or {HOLDING_REGISTERS + 1}.
- **Functions**: Functions 03 and 04 read the same registers. Functions 06, 16, 22 and 23 write the registers
  with access RW. Function 02 reads the status bits as discrete inputs 0–31. Function 43/14 reads the
  identification: objects 0–6, the serial number (object 80h) and the calibration date (object 81h).
- **Word order**: 32-bit values have their high word first (ABCD). To change the word order to CDAB, use the
  configuration.
- **Blocks**: A read must lie within one of the blocks {", ".join(f"{a}–{b}" for a, b in BLOCKS)}.
  If an address in a block is not listed here, its value is 0.
- **n/a**: This column of the tables contains the code for "not available". The status bits show the
  reason.
- **TCP**: The defaults are port 5020 and unit id 1. The instrument also accepts requests to the unit ids 0
  and 255. The answer to a request with any other unit id is exception 0Bh.
- **Serial line** (Modbus RTU): The serial line is disabled by default. Its default settings are 19200 Bd,
  even parity and unit id 1. The instrument does not answer requests to other units. A broadcast can only
  vent.

| exception | meaning |
| --- | --- |
| 01 | The function or its subfunction is not supported (08 only with 0, 43 only with 14). \
Or the request is a write, and `read_only` or the role of the client \
(Modbus/TCP Security) does not permit it. |
| 02 | An address is outside the blocks, a read extends over two blocks, or a written register is not RW. \
Functions 01, 05 and 15: the instrument has no coils. \
Function 43/14: there is no object with this number. |
| 03 | The length of the request or the number of registers is wrong, a value is out of range or NaN, \
or a write contains only one register of a 32-bit value. A read of one register returns half a value. |
| 04 | Internal error of the instrument, which its log describes. \
A write was perhaps executed: proceed as after a time-out. |
| 06 | The write is rejected in the present state. Register 27 shows the reason. |
| 0Bh | TCP only: the unit id is neither the configured one nor 0 or 255. \
Nothing is executed, not even a vent. |

There are no other exceptions. A request with a function of 80h or above is not answered, and over TCP the
connection is closed. A request that contains only a vent is accepted even if writes are not permitted.

Many libraries call exception 06 *busy*. Disable automatic retries of such requests in your Modbus library.

If the instrument answers a request with exception 01, 02, 03 or 06, the request changes nothing. However, a
vent (516 := 0) in such a request is still executed if the length of the request is right.
"""
_STATUS = """\
## Status bits

Register 20 (uint32), the Status frame and the discrete inputs 0–31 contain these bits. A bit that *latches*
stays set until a command clears it, even if the cause of the bit is gone. Any other bit is set only while its
cause is present. The page [faults.md](faults.md) lists the remedy for each bit, fault and reject reason.
"""
_FRAMES = """\
## CAN frames

The bus is Classic CAN with 11-bit identifiers. All values are little-endian. N is the node id, which is
{node_id} by default. The command `pneuforce map --format dbc` prints the frames as a DBC file.
"""
_COMMAND = """\
The instrument checks the length of a Command, then the ranges, and then the sequence number. A Command with
the same sequence number and the same content renews the lease and is not executed again. A Command with the
same sequence number but different content is rejected. A vent of full length is always executed, even if
other fields are invalid.
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
        "## Condensed status bits\n\nRegister 71 and the Force frame contain these bits.\n",
        _bits(CONDENSED),
        "## Causes of maintenance\n\nRegister 74 contains these bits. The list of the "
        "[remedies](faults.md#causes-of-maintenance) contains what to do.\n",
        _bits(MAINTENANCE_CAUSES),
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
        format_range(register) or _code_range(register),
        format_not_available(register),
        "RW" if register.writable else "R",
        register.doc,
    )


def _code_range(register: Register) -> str:
    """Return the codes that can be written to an enumeration as "0 … 1"; otherwise an empty string."""
    if not (register.writable and register.values):
        return ""
    return f"{min(register.values.names)} … {max(register.values.names)}"


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
