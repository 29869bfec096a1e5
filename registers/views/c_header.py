"""The register map as one C header for programs that speak Modbus: numbers, names, and value with valid.

C99 and C++11, without undefined or implementation-defined behaviour: bits become numbers by memcpy.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator

from registers.codes import STATUS
from registers.field import Values, Wire
from registers.map import BLOCKS, COMMAND_KEY, MAP_HASH, MAP_VERSION, REGISTERS, Register
from registers.views.facts import ENUMERATIONS, MEASURED, TEST, ascii_text, number

_C_TYPES = {Wire.F32: "float", Wire.U32: "uint32_t", Wire.I16: "int16_t", Wire.U16: "uint16_t"}

_HEAD = f"""\
/* pneuforce: the register map for programs in C99 and C++11.
 * Map version {MAP_VERSION}, hash {MAP_HASH:08X}h (registers 768 and 770).
 * Made from the register map: pneuforce map --format h. How to use it: docs/plc.md.
 *
 * A function takes the words of a block, as read from that block's first address on, each a number of this
 * machine (as libmodbus delivers them). It stores the value and returns whether it is one: false for "not
 * available", the value being 0 then. Whether the words are fresh only the sample counter can tell.
 */
#ifndef PNEUFORCE_REGISTERS_H
#define PNEUFORCE_REGISTERS_H

#include <stdbool.h>
#include <stdint.h>
#include <string.h>
"""
_WORDS = """\
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
/* Settles the word order from {len(TEST)} words from {TEST.start} on; false: no pneuforce's. */
static inline bool pneuforce_word_order(const uint16_t *test, bool *low_word_first)
{{
"""


def render() -> str:
    """The header."""
    parts = [
        _HEAD,
        "".join(_macros()),
        *(_enumeration(name, values) for name, values in ENUMERATIONS.items()),
        _WORDS,
        *(_function(register) for register in REGISTERS),
        _word_order(),
        "#endif\n",
    ]
    return "\n".join(parts)


def _macros() -> Iterator[str]:
    yield f"#define PNEUFORCE_MAP_VERSION {MAP_VERSION}\n"
    yield f"#define PNEUFORCE_MAP_HASH UINT32_C(0x{MAP_HASH:08X})\n"
    yield f"#define PNEUFORCE_COMMAND_KEY {COMMAND_KEY}\n"
    yield f"#define PNEUFORCE_COUNT_MEASURED {len(MEASURED)} /* words from 0: one read is one instant */\n"
    yield f"#define PNEUFORCE_COUNT_TEST {len(TEST)}\n"
    for register in REGISTERS:
        yield f"#define {_macro('ADDRESS', register)} {register.address}\n"
    for register in REGISTERS:
        if register.writable and register.unit:
            suffix = "f" if register.wire is Wire.F32 else ""
            for word, value in (("LEAST", register.low), ("GREATEST", register.high)):
                text = repr(float(value or 0)) if suffix else number(value or 0)
                yield f"#define {_macro(word, register)} {text}{suffix} /* {ascii_text(register.unit)} */\n"
    for bit in STATUS.bits:
        mask = f"UINT32_C(0x{1 << bit.number:08X})"
        yield f"#define PNEUFORCE_STATUS_{bit.name.upper()} {mask} /* {ascii_text(bit.doc)} */\n"


def _macro(kind: str, register: Register) -> str:
    return f"PNEUFORCE_{kind}_{register.name.upper()}"


def _enumeration(name: str, values: Values) -> str:
    plain = name.replace(" ", "_")
    listed = ",\n".join(
        f"    PNEUFORCE_{plain.upper()}_{value.upper()} = {code}" for code, value in values.names.items()
    )
    return f"enum pneuforce_{plain} {{\n{listed}\n}};\n"


def _function(register: Register) -> str:
    """What takes one register out of the words of its block; the word order only where it matters."""
    start = next(first for first, last in BLOCKS if first <= register.address <= last)
    at = register.address - start
    order = ", bool low_word_first" if register.wire.words == 2 else ""
    head = f"bool {_name(register)}(const uint16_t *from_{start}{order}, {_C_TYPES[register.wire]} *value)"
    unit = f" [{register.unit}]" if register.unit else ""
    return (
        f"/* {register.address}: {ascii_text(register.doc + unit)} */\n"
        f"static inline {head}\n{{\n{_taken(register, f'from_{start}', at)}}}\n"
    )


def _name(register: Register) -> str:
    unit = ascii_text(register.unit).replace("/", "_per_").lower()
    ends = not unit or register.name.endswith(f"_{unit}")
    return f"pneuforce_{register.name}" if ends else f"pneuforce_{register.name}_{unit}"


def _taken(register: Register, words: str, at: int) -> str:
    if register.wire is Wire.F32:
        return f"    return pneuforce_float({words} + {at}, low_word_first, value);\n"
    if register.not_available is not None:
        kind = "int16" if register.wire is Wire.I16 else "uint16"
        return f"    return pneuforce_{kind}({words}[{at}], value);\n"
    if register.wire is Wire.U32:
        taken = f"*value = pneuforce_bits({words} + {at}, low_word_first);"
    else:
        taken = f"memcpy(value, {words} + {at}, sizeof *value);"
    return f"    {taken}\n    return true;\n"


def _word_order() -> str:
    tests = [register for register in REGISTERS if register.address in TEST]
    last = tests[-1]
    wide = " && ".join(
        f"pneuforce_bits(test + {r.address - TEST.start}, *low_word_first) == UINT32_C(0x{_bits(r):08X})"
        for r in tests
        if r.wire.words == 2
    )
    return (
        f"{_WORD_ORDER}"
        f"    *low_word_first = test[0] == UINT16_C(0x{_bits(tests[0]) & 0xFFFF:04X});\n"
        f"    return {wide.replace(' && ', chr(10) + '        && ')}\n"
        f"        && test[{last.address - TEST.start}] == UINT16_C(0x{_bits(last):04X});\n}}\n"
    )


def _bits(register: Register) -> int:
    return int.from_bytes(struct.pack(f">{register.wire.code}", register.constant), "big")
