"""Elementary types of IEC 61131-3: ranges, wrap-around, conversions, and operations."""

import math
import operator
import struct
from dataclasses import dataclass


class PlcError(Exception):
    """Error for a program that not every PLC runs with the same result."""


@dataclass(frozen=True)
class Type:
    """Elementary type with the number of its bits."""

    name: str
    kind: str  #: "bool", "bits", "integer", "real", "time" or "text"
    bits: int
    signed: bool = False

    def value(self, number):
        """Return `number` as a value of this type. Integers and bits wrap around."""
        if self.kind == "text":
            return str(number or "")
        if self.kind == "bool":
            return bool(number)
        if self.kind == "real":
            return as_real(number)
        wrapped = int(number) & ((1 << self.bits) - 1)
        return wrapped - (1 << self.bits) if self.signed and wrapped >> (self.bits - 1) else wrapped


def as_real(number):
    """Return a number rounded to 32 bits. Numbers that are too large become infinite (IEC 60559)."""
    try:
        return struct.unpack("<f", struct.pack("<f", number))[0]
    except OverflowError:
        return math.copysign(math.inf, number)


TYPES = {
    type_.name: type_
    for type_ in (
        Type("BOOL", "bool", 1),
        Type("BYTE", "bits", 8),
        Type("WORD", "bits", 16),
        Type("DWORD", "bits", 32),
        Type("SINT", "integer", 8, signed=True),
        Type("INT", "integer", 16, signed=True),
        Type("DINT", "integer", 32, signed=True),
        Type("USINT", "integer", 8),
        Type("UINT", "integer", 16),
        Type("UDINT", "integer", 32),
        Type("REAL", "real", 32),
        Type("STRING", "text", 0),
        Type("TIME", "time", 64, signed=True),  # the value is in milliseconds
    )
}
#: Types of literals without a type. Such a literal takes the type of the other operand.
ANY_INT, ANY_REAL = Type("literal integer", "integer", 64, signed=True), Type("literal real", "real", 64)
LITERALS = (ANY_INT, ANY_REAL)


def fits(source, target):
    """Return True if a value converts to `target` without a function (IEC 61131-3:2013, figure 11)."""
    if source == target:
        return True
    if source == ANY_INT:
        return target.kind in ("integer", "bits", "real")
    if source == ANY_REAL:
        return target.kind == "real"
    if source.kind == "integer" and target.kind == "integer":
        wider = target.bits > source.bits
        return wider and (target.signed or not source.signed)
    if source.kind == "integer" and target.kind == "real":
        return source.bits < 24  # each value has an exact REAL
    return source.kind in ("bool", "bits") and target.kind == "bits" and target.bits > source.bits


def common(left, right):
    """Return the type in which an operation of two types is calculated. Raises PlcError if there is none."""
    for one, other in ((left, right), (right, left)):
        if fits(one, other) and not (one != other and other in LITERALS and one not in LITERALS):
            return other
    raise PlcError(f"{left.name} and {right.name} have no common type")


def convert(source, target, value):
    """Return `value` after a conversion function such as WORD_TO_INT.

    Bits keep their pattern. A REAL is rounded to the nearest integer, and halves to the even one. A REAL that
    does not fit raises PlcError, because the result differs between PLCs.
    """
    if source.kind == "real" and target.kind == "integer":
        if not math.isfinite(value) or target.value(round(value)) != round(value):
            raise PlcError(f"{value} does not fit into {target.name}")
        return round(value)
    return target.value(value)


def divide(kind, left, right):
    """Return the quotient. Integers are truncated towards zero. Raises PlcError for a divisor of 0."""
    if right == 0:
        raise PlcError("division by zero")
    if kind == "real":
        return left / right
    return abs(left) // abs(right) * (1 if (left < 0) == (right < 0) else -1)


def modulo(kind, left, right):
    """Return the remainder, with the sign of the dividend. Raises PlcError for a divisor of 0."""
    return left - right * divide(kind, left, right)


#: Operators that return a value of their operands' type.
ARITHMETIC = {
    "+": lambda kind, a, b: a + b,
    "-": lambda kind, a, b: a - b,
    "*": lambda kind, a, b: a * b,
    "/": divide,
    "MOD": modulo,
}
LOGIC = {"AND": operator.and_, "&": operator.and_, "OR": operator.or_, "XOR": operator.xor}
COMPARISONS = {
    "=": operator.eq,
    "<>": operator.ne,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}
