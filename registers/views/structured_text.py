"""A library in Structured Text (IEC 61131-3) for PLC programs: constants, types and function blocks.

It keeps to what CODESYS, TwinCAT, Siemens SCL and matiec have in common: no pragmas, no pointers, no unions,
no methods, no enumeration types (Siemens has none, and a code that is new would have no name), and no
conversion between REAL and DWORD, which copies the bits on one PLC and converts the number on another.
"""

from __future__ import annotations

from collections.abc import Iterator

from registers.codes import STATUS
from registers.field import Wire
from registers.map import COMMAND_KEY, MAP_HASH, MAP_VERSION, REGISTERS, Register
from registers.views.facts import ENUMERATIONS, MEASURED, ascii_text, number
from registers.views.st_pressure import pressure_block
from registers.views.st_reading import reading_blocks

_HEAD = f"""\
(* pneuforce: library for PLC programs in Structured Text, IEC 61131-3.
   Map version {MAP_VERSION}, hash {MAP_HASH:08X}h (registers 768 and 770).
   Made from the register map: pneuforce map --format st. How to use it: docs/plc.md.

   No block talks to the instrument itself: your PLC's Modbus master does, and hands over the words. *)
"""


def render() -> str:
    """The library: constants, types, blocks, each declared before it is used."""
    return "\n".join((_HEAD, _constants(), reading_blocks(), pressure_block()))


def _constants() -> str:
    lines = "".join(f"    {line}\n" for line in _declarations())
    return f"VAR_GLOBAL CONSTANT\n{lines}END_VAR\n"


def _declarations() -> Iterator[str]:
    yield f"PF_MAP_VERSION : UINT := {MAP_VERSION};"
    yield f"PF_MAP_HASH : DWORD := DWORD#16#{MAP_HASH:08X};"
    yield f"PF_COUNT_MEASURED : UINT := {len(MEASURED)};  (* words from address 0: one read is one instant *)"
    yield f"PF_COMMAND_KEY : UINT := {COMMAND_KEY};"
    for register in REGISTERS:
        yield f"PF_ADDRESS_{register.name.upper()} : UINT := {register.address};{_comment(register)}"
    for register in REGISTERS:
        yield from _span(register)
    for name, values in ENUMERATIONS.items():
        for code, value in values.names.items():
            yield f"PF_{name.replace(' ', '_').upper()}_{value.upper()} : UINT := {code};"
    for bit in STATUS.bits:
        mask = f"DWORD#16#{1 << bit.number:08X}"
        yield f"PF_STATUS_{bit.name.upper()} : DWORD := {mask};  (* {ascii_text(bit.doc)} *)"


def _comment(register: Register) -> str:
    unit = f" [{register.unit}]" if register.unit else ""
    return f"  (* {ascii_text(register.doc + unit)} *)"


def _span(register: Register) -> Iterator[str]:
    """Least and greatest value that may be written."""
    if not register.writable or not register.unit:
        return
    real = register.wire is Wire.F32
    for word, value in (("LEAST", register.low or 0), ("GREATEST", register.high or 0)):
        text = f"REAL := {float(value)!r}" if real else f"UINT := {number(value)}"
        yield f"PF_{word}_{register.name.upper()} : {text};  (* {ascii_text(register.unit)} *)"
