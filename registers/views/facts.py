"""What every document says of a field, in words."""

from __future__ import annotations

import math
from collections.abc import Mapping

from registers.codes import ANSWERS, COMMANDS, FAULTS, HOLDERS, METHODS, MODES, REFUSALS, STATES
from registers.field import Field, Values, Wire
from registers.map import BY_NAME

TYPES: Mapping[Wire, str] = {
    Wire.F32: "float32",
    Wire.U32: "uint32",
    Wire.I16: "int16",
    Wire.U16: "uint16",
    Wire.U8: "uint8",
}

#: The enumerations of the register map, by the name that the documents give them.
ENUMERATIONS: Mapping[str, Values] = {
    "state": STATES,
    "refusal": REFUSALS,
    "mode": MODES,
    "lease holder": HOLDERS,
    "command code": COMMANDS,
    "answer state": ANSWERS,
    "method": METHODS,
    "fault": FAULTS,
}


#: What tools that write the kind of register into its number add to it: the first are 30001 and 40001.
INPUT_REGISTERS, HOLDING_REGISTERS = 30_000, 40_000

#: The block of measured values: one read of it is one instant.
MEASURED = range(BY_NAME["baseline_age"].end)
#: The block of the test pattern, which settles the word order.
TEST = range(BY_NAME["test_float"].address, BY_NAME["test_int"].end)

_ASCII = str.maketrans({"Δ": "D", "µ": "u", "–": "-", "−": "-", "…": "...", "²": "2", "×": "x", '"': "'"})


def ascii_text(text: str) -> str:
    """A text in characters that every tool reads alike."""
    return text.translate(_ASCII)


def span(field: Field) -> tuple[float, float] | None:
    """Least and greatest value in the field's unit, the not-available code left out; None for what has none.

    Where no span is declared, that is what the wire can hold.
    """
    if field.bits or field.values or field.constant is not None:
        return None
    if field.low is not None and field.high is not None:
        return min((field.low, *field.also)), field.high
    if field.wire.lowest is None:
        return None
    return field.wire.lowest, field.largest


def span_text(field: Field) -> str:
    """The declared span: "2 … 12", "0 or 200 … 60000", a constant, or nothing."""
    if field.constant is not None:
        return number(field.constant)
    if field.low is None or field.high is None:
        return ""
    also = "".join(f"{number(value)} or " for value in field.also)
    if field.low == field.high:
        return also + number(field.low)
    return f"{also}{number(field.low)} … {number(field.high)}"


def not_available_text(field: Field) -> str:
    """The code that says "no value", as a programmer writes it; empty where there is none."""
    code = field.not_available
    if code is None:
        return ""
    return "NaN" if math.isnan(code) else f"{int(code):X}h"


def number(value: float) -> str:
    """A number without needless digits."""
    return str(int(value)) if value == int(value) else f"{value:.9g}"
