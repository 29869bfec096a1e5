"""Text for the fields of the register map: type names, ranges and numbers as the documents show them."""

from __future__ import annotations

import math
from collections.abc import Mapping

from pneuforce.registers.codes import (
    AMBIENT_SOURCES,
    ANSWERS,
    COMMANDS,
    FAULTS,
    FIRMWARE_ORIGINS,
    HOLDERS,
    METHODS,
    MODES,
    PROOF_TESTS,
    REJECT_REASONS,
    SIGNATURES,
    STATES,
)
from pneuforce.registers.field import Enumeration, Field, WireType
from pneuforce.registers.map import BY_NAME

TYPE_NAMES: Mapping[WireType, str] = {
    WireType.F32: "float32",
    WireType.U32: "uint32",
    WireType.I32: "int32",
    WireType.I16: "int16",
    WireType.U16: "uint16",
    WireType.U8: "uint8",
}

#: Enumerations of the register map, by their names in the documents.
ENUMERATIONS: Mapping[str, Enumeration] = {
    "state": STATES,
    "reject_reason": REJECT_REASONS,
    "mode": MODES,
    "lease holder": HOLDERS,
    "command code": COMMANDS,
    "answer state": ANSWERS,
    "method": METHODS,
    "fault": FAULTS,
    "proof test": PROOF_TESTS,
    "ambient source": AMBIENT_SOURCES,
    "firmware origin": FIRMWARE_ORIGINS,
    "signature": SIGNATURES,
}


#: Offsets for tools in which input registers have numbers from 30001, and holding registers from 40001.
INPUT_REGISTERS, HOLDING_REGISTERS = 30_000, 40_000

#: Addresses of the measured values. All values in one answer belong to the same instant.
MEASURED_BLOCK = range(BY_NAME["baseline_age"].end)
#: Addresses of the identity, the faults and the head of the event log.
DIAGNOSTIC_BLOCK = range(BY_NAME["map_version"].address, BY_NAME["firmware_image"].end)
#: Addresses of the test pattern, which shows the word order.
TEST_BLOCK = range(BY_NAME["test_float"].address, BY_NAME["test_int"].end)

_ASCII = str.maketrans({"Δ": "D", "µ": "u", "–": "-", "−": "-", "…": "...", "²": "2", "×": "x", '"': "'"})


def ascii_text(text: str) -> str:
    """Return `text` in ASCII, for tools that do not read UTF-8."""
    return text.translate(_ASCII)


def name_with_unit(field: Field) -> str:
    """Return the name of a value in program code, for example `force_n` or `baseline_drift_kpa_per_s`."""
    unit = ascii_text(field.unit).replace("/", "_per_").lower()
    return field.name if not unit or field.name.endswith(f"_{unit}") else f"{field.name}_{unit}"


def value_range(field: Field) -> tuple[float, float] | None:
    """Return the smallest and largest value in the field's unit, without the not-available code.

    If no range is declared, the limits are those of the wire type. Returns None for bit fields, enumerations,
    constants and float32 values without a declared range.
    """
    if field.bits or field.values or field.constant is not None:
        return None
    if field.low is not None and field.high is not None:
        return min((field.low, *field.also_allowed)), field.high
    if field.wire.min_code is None:
        return None
    return field.wire.min_code, field.max_value_code


def format_range(field: Field) -> str:
    """Return the declared range as "2 … 12" or "0 or 200 … 60000", or the constant, or an empty string."""
    if field.constant is not None:
        return format_number(field.constant)
    if field.low is None or field.high is None:
        return ""
    also = "".join(f"{format_number(value)} or " for value in field.also_allowed)
    if field.low == field.high:
        return also + format_number(field.low)
    return f"{also}{format_number(field.low)} … {format_number(field.high)}"


def format_not_available(field: Field) -> str:
    """Return the not-available code as "NaN" or "7FFFh"; empty if the field has none."""
    code = field.not_available
    if code is None:
        return ""
    return "NaN" if math.isnan(code) else f"{int(code):X}h"


def format_number(value: float) -> str:
    """Return a number without trailing zeros, with at most nine significant digits."""
    return str(int(value)) if value == int(value) else f"{value:.9g}"
