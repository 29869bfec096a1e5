"""Structured Text library (IEC 61131-3) for PLC programs: constants, types and function blocks.

The library uses only language elements that CODESYS, TwinCAT and matiec support, and that `siemens_scl` can
write in the notation of TIA Portal. It contains no pragmas, pointers, unions or methods. It contains no
enumeration types, because Siemens SCL does not support them, and because a newer instrument may send a code
that has no name in the library. It does not convert between REAL and DWORD, because some PLCs copy the bits
and others convert the number.
"""

from __future__ import annotations

from collections.abc import Iterator

from pneuforce.registers.codes import MAINTENANCE_CAUSES, STATUS
from pneuforce.registers.document_text import ENUMERATIONS, MEASURED_BLOCK, ascii_text, format_number
from pneuforce.registers.field import WireType
from pneuforce.registers.map import COMMAND_KEY, MAP_VERSION, REGISTERS, Register
from pneuforce.registers.map_hash import MAP_HASH
from pneuforce.registers.views.st_diagnostics import diagnostics_block
from pneuforce.registers.views.st_pressure import pressure_block
from pneuforce.registers.views.st_reading import reading_blocks
from pneuforce.registers.views.st_settings import settings_block

#: Types of the smallest and largest value of a register.
_LIMIT_TYPES = {WireType.F32: "REAL", WireType.I16: "INT", WireType.U16: "UINT"}

_HEAD = f"""\
(* pneuforce: library for PLC programs in Structured Text, IEC 61131-3.
   Map version {MAP_VERSION}, hash {MAP_HASH:08X}h (registers 768 and 770).
   Generated from the register map: pneuforce map --format st. Instructions: docs/plc.md.

   The function blocks do not communicate. The Modbus master of the PLC reads and writes the registers. The
   PLC program passes the words between the master and the blocks. *)
"""


def render() -> str:
    """Return the library: constants, types and blocks, each declared before it is used."""
    blocks = (reading_blocks(), pressure_block(), diagnostics_block(), settings_block())
    return "\n".join((_HEAD, _constants(), *blocks))


def _constants() -> str:
    lines = "".join(f"    {line}\n" for line in _declarations())
    return f"VAR_GLOBAL CONSTANT\n{lines}END_VAR\n"


def _declarations() -> Iterator[str]:
    yield f"PF_MAP_VERSION : UINT := {MAP_VERSION};"
    yield f"PF_MAP_HASH : DWORD := DWORD#16#{MAP_HASH:08X};"
    comment = "words from address 0; the values of one read belong to one instant"
    yield f"PF_COUNT_MEASURED : UINT := {len(MEASURED_BLOCK)};  (* {comment} *)"
    yield f"PF_COMMAND_KEY : UINT := {COMMAND_KEY};"
    for register in REGISTERS:
        yield f"PF_ADDRESS_{register.name.upper()} : UINT := {register.address};{_comment(register)}"
    for register in REGISTERS:
        yield from _limits(register)
    for name, values in ENUMERATIONS.items():
        for code, value in values.names.items():
            yield f"PF_{name.replace(' ', '_').upper()}_{value.upper()} : UINT := {code};"
    for bit in STATUS.bits:
        mask = f"DWORD#16#{1 << bit.number:08X}"
        yield f"PF_STATUS_{bit.name.upper()} : DWORD := {mask};  (* {ascii_text(bit.doc)} *)"
    for bit in MAINTENANCE_CAUSES.bits:
        mask = f"WORD#16#{1 << bit.number:04X}"
        yield f"PF_MAINTENANCE_{bit.name.upper()} : WORD := {mask};  (* {ascii_text(bit.doc)} *)"


def _comment(register: Register) -> str:
    unit = f" [{register.unit}]" if register.unit else ""
    return f"  (* {ascii_text(register.doc + unit)} *)"


def _limits(register: Register) -> Iterator[str]:
    """Yield the constants for the smallest and largest value that may be written."""
    if not register.writable or not register.unit:
        return
    type_ = _LIMIT_TYPES[register.wire]
    for prefix, value in (("MIN", register.low or 0), ("MAX", register.high or 0)):
        number = repr(float(value)) if type_ == "REAL" else format_number(value)
        yield f"PF_{prefix}_{register.name.upper()} : {type_} := {number};  (* {ascii_text(register.unit)} *)"
