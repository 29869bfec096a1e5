"""Register map as a C header for Modbus clients: constants, and functions that decode each register.

The header is valid in C99 and C++11. It has no undefined or implementation-defined behaviour, because memcpy
converts bits to numbers.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator

from pneuforce.registers.codes import MAINTENANCE_CAUSES, STATUS
from pneuforce.registers.document_text import (
    ENUMERATIONS,
    MEASURED_BLOCK,
    TEST_BLOCK,
    ascii_text,
    format_number,
    name_with_unit,
)
from pneuforce.registers.field import Enumeration, WireType
from pneuforce.registers.map import BLOCKS, COMMAND_KEY, MAP_VERSION, REGISTERS, Register
from pneuforce.registers.map_hash import MAP_HASH

_C_TYPES = {
    WireType.F32: "float",
    WireType.U32: "uint32_t",
    WireType.I16: "int16_t",
    WireType.U16: "uint16_t",
}

_HEAD = f"""\
/* pneuforce: register map for programs in C99 and C++11.
 * Map version {MAP_VERSION}, hash {MAP_HASH:08X}h (registers 768 and 770).
 * Generated from the register map: pneuforce map --format h. Instructions: docs/plc.md.
 *
 * Each function takes the words of one block, read from the first address of the block. The words have the
 * byte order of this machine, as libmodbus delivers them. The function stores the value and returns true if
 * the value is valid. If the value is not available, the function stores 0 and returns false. Check the
 * sample counter as well: if the counter does not change, the words are old.
 */
#ifndef PNEUFORCE_REGISTERS_H
#define PNEUFORCE_REGISTERS_H

#include <stdbool.h>
#include <stdint.h>
#include <string.h>
"""
_DECODERS = """\
static inline uint32_t pneuforce_bits(const uint16_t *words, bool low_word_first)
{
    uint32_t first = words[0], second = words[1];
    return low_word_first ? second << 16 | first : first << 16 | second;
}

static inline bool pneuforce_float(const uint16_t *words, bool low_word_first, float *value)
{
    uint32_t bits = pneuforce_bits(words, low_word_first);
    bool valid = (bits & UINT32_C(0x7F800000)) != UINT32_C(0x7F800000); /* neither NaN nor infinity */
    if (!valid)
        bits = 0;
    memcpy(value, &bits, sizeof bits);
    return valid;
}

static inline bool pneuforce_int16(uint16_t word, int16_t *value)
{
    bool valid = word != UINT16_C(0x7FFF);
    if (!valid)
        word = 0;
    memcpy(value, &word, sizeof word);
    return valid;
}

static inline bool pneuforce_uint16(uint16_t word, uint16_t *value)
{
    bool valid = word != UINT16_C(0xFFFF);
    *value = valid ? word : UINT16_C(0);
    return valid;
}
"""
_WORD_ORDER = f"""\
/* Finds the word order from the {len(TEST_BLOCK)} test words at address {TEST_BLOCK.start}.
 * Returns false if the server is not a pneuforce instrument. */
static inline bool pneuforce_word_order(const uint16_t *test, bool *low_word_first)
{{
"""


def render() -> str:
    """Return the header file."""
    parts = [
        _HEAD,
        "".join(_macros()),
        *(_enumeration(name, values) for name, values in ENUMERATIONS.items()),
        _DECODERS,
        *(_function(register) for register in REGISTERS),
        _word_order(),
        "#endif\n",
    ]
    return "\n".join(parts)


def _macros() -> Iterator[str]:
    yield f"#define PNEUFORCE_MAP_VERSION {MAP_VERSION}\n"
    yield f"#define PNEUFORCE_MAP_HASH UINT32_C(0x{MAP_HASH:08X})\n"
    yield f"#define PNEUFORCE_COMMAND_KEY {COMMAND_KEY}\n"
    comment = "words from address 0; the values of one read belong to one instant"
    yield f"#define PNEUFORCE_COUNT_MEASURED {len(MEASURED_BLOCK)} /* {comment} */\n"
    yield f"#define PNEUFORCE_COUNT_TEST {len(TEST_BLOCK)}\n"
    for register in REGISTERS:
        yield f"#define {_macro('ADDRESS', register)} {register.address}\n"
    for register in REGISTERS:
        if register.writable and register.unit:
            suffix = "f" if register.wire is WireType.F32 else ""
            for prefix, value in (("MIN", register.low), ("MAX", register.high)):
                text = repr(float(value or 0)) if suffix else format_number(value or 0)
                yield f"#define {_macro(prefix, register)} {text}{suffix} /* {ascii_text(register.unit)} */\n"
    for bit in STATUS.bits:
        mask = f"UINT32_C(0x{1 << bit.number:08X})"
        yield f"#define PNEUFORCE_STATUS_{bit.name.upper()} {mask} /* {ascii_text(bit.doc)} */\n"
    for bit in MAINTENANCE_CAUSES.bits:
        mask = f"UINT16_C(0x{1 << bit.number:04X})"
        yield f"#define PNEUFORCE_MAINTENANCE_{bit.name.upper()} {mask} /* {ascii_text(bit.doc)} */\n"


def _macro(prefix: str, register: Register) -> str:
    return f"PNEUFORCE_{prefix}_{register.name.upper()}"


def _enumeration(name: str, values: Enumeration) -> str:
    identifier = name.replace(" ", "_")
    listed = ",\n".join(
        f"    PNEUFORCE_{identifier.upper()}_{value.upper()} = {code}" for code, value in values.names.items()
    )
    return f"enum pneuforce_{identifier} {{\n{listed}\n}};\n"


def _function(register: Register) -> str:
    """Return the C function that decodes one register. Only 32-bit registers need the word-order argument."""
    start = next(first for first, last in BLOCKS if first <= register.address <= last)
    words = f"from_{start}"
    word_order = ", bool low_word_first" if register.wire.words == 2 else ""
    name = f"pneuforce_{name_with_unit(register)}"
    head = f"bool {name}(const uint16_t *{words}{word_order}, {_C_TYPES[register.wire]} *value)"
    unit = f" [{register.unit}]" if register.unit else ""
    return (
        f"/* {register.address}: {ascii_text(register.doc + unit)} */\n"
        f"static inline {head}\n{{\n{_function_body(register, words, register.address - start)}}}\n"
    )


def _function_body(register: Register, words: str, index: int) -> str:
    if register.wire is WireType.F32:
        return f"    return pneuforce_float({words} + {index}, low_word_first, value);\n"
    if register.not_available is not None:
        type_ = "int16" if register.wire is WireType.I16 else "uint16"
        return f"    return pneuforce_{type_}({words}[{index}], value);\n"
    if register.wire is WireType.U32:
        assignment = f"*value = pneuforce_bits({words} + {index}, low_word_first);"
    else:
        assignment = f"memcpy(value, {words} + {index}, sizeof *value);"
    return f"    {assignment}\n    return true;\n"


def _word_order() -> str:
    tests = [register for register in REGISTERS if register.address in TEST_BLOCK]
    start, last = TEST_BLOCK.start, tests[-1]
    two_word_tests = " && ".join(
        f"pneuforce_bits(test + {r.address - start}, *low_word_first) == UINT32_C(0x{_bits(r):08X})"
        for r in tests
        if r.wire.words == 2
    )
    return (
        f"{_WORD_ORDER}"
        f"    *low_word_first = test[0] == UINT16_C(0x{_bits(tests[0]) & 0xFFFF:04X});\n"
        f"    return {two_word_tests.replace(' && ', chr(10) + '        && ')}\n"
        f"        && test[{last.address - start}] == UINT16_C(0x{_bits(last):04X});\n}}\n"
    )


def _bits(register: Register) -> int:
    return int.from_bytes(struct.pack(f">{register.wire.code}", register.constant), "big")
