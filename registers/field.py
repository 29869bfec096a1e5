"""Description of one value on a wire: its type, unit, range and not-available code."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property

from pneuforce.support.float32_text import float32_text

#: Wire unit → (unit suffix of the quantity's name, wire counts per unit of the quantity).
UNITS: Mapping[str, tuple[str, float]] = {
    "N": ("n", 1.0),
    "mN": ("n", 1e3),
    "kPa": ("kpa", 1.0),
    "Pa": ("kpa", 1e3),
    "kPa/s": ("kpa_per_s", 1.0),
    "mm": ("mm", 1.0),
    "µm": ("mm", 1e3),
    "s": ("s", 1.0),
    "ms": ("s", 1e3),
}


def quantity_unit(unit: str) -> str:
    """Return the unit of the quantity for a wire unit, for example N for mN; "" if `unit` is empty."""
    suffix = UNITS[unit][0] if unit else None
    return next((name for name, entry in UNITS.items() if entry == (suffix, 1.0)), "")


class WireType(Enum):
    """Binary type of a value: its `struct` code, its size in bytes, and its smallest and largest code."""

    F32 = ("f", 4, None, None)
    U32 = ("I", 4, 0, 0xFFFF_FFFF)
    I32 = ("i", 4, -0x8000_0000, 0x7FFF_FFFF)
    I16 = ("h", 2, -0x8000, 0x7FFF)
    U16 = ("H", 2, 0, 0xFFFF)
    U8 = ("B", 1, 0, 0xFF)

    def __init__(self, code: str, size: int, min_code: int | None, max_code: int | None) -> None:
        self.code = code
        self.size = size
        self.min_code = min_code
        self.max_code = max_code

    @property
    def words(self) -> int:
        """Return the number of 16-bit Modbus words."""
        return (self.size + 1) // 2


@dataclass(frozen=True, slots=True)
class StatusBit:
    """One named condition in a bit field."""

    number: int
    name: str
    doc: str
    latches: bool = False  #: the bit stays set until a command clears it, even if its cause is gone


@dataclass(frozen=True, eq=False)
class BitField:
    """Set of named conditions, one per bit."""

    bits: tuple[StatusBit, ...]

    @cached_property
    def _masks(self) -> Mapping[str, int]:
        return {bit.name: 1 << bit.number for bit in self.bits}

    def code(self, names: Iterable[str]) -> int:
        """Return the integer in which the bits of `names` are set. Names without a bit are ignored."""
        return sum(self._masks.get(name, 0) for name in names)

    def names(self, code: int) -> frozenset[str]:
        """Return the names of the bits that are set in `code`."""
        return frozenset(bit.name for bit in self.bits if code >> bit.number & 1)


@dataclass(frozen=True, eq=False)
class Enumeration:
    """Set of named codes."""

    names: Mapping[int, str]

    @cached_property
    def codes(self) -> Mapping[str, int]:
        """Return the code of each name."""
        return {name: code for code, name in self.names.items()}


@dataclass(frozen=True, slots=True, kw_only=True)
class Field:
    """One value on a wire, bound to a quantity of the source or to a constant.

    Exactly one of `quantity` and `constant` is given. `values` lists the codes of an enumeration; the
    quantity is then a name. `bits` lists the conditions of a bit field; the quantity is then a set of names.
    `legend` explains the codes of a number. Such a quantity stays a number, because a newer board may send a
    code that is missing in the legend.
    """

    name: str
    wire: WireType
    doc: str
    quantity: str = ""
    constant: float | None = None
    unit: str = ""
    low: float | None = None  #: smallest accepted or meaningful value, in `unit`
    high: float | None = None  #: largest accepted or meaningful value, in `unit`
    also_allowed: tuple[float, ...] = ()  #: accepted values outside `low` to `high`
    always_available: bool = False  #: has a unit but no not-available code, for example an age
    values: Enumeration | None = None
    bits: BitField | None = None
    legend: Enumeration | None = None

    @property
    def code_names(self) -> Mapping[int, str]:
        """Return the name of each code; empty if the field has no named codes."""
        named = self.values or self.legend
        return named.names if named else {}

    @property
    def scale(self) -> float:
        """Return the wire counts per unit of the quantity."""
        return UNITS[self.unit][1] if self.unit else 1.0

    @property
    def not_available(self) -> float | None:
        """Return the not-available code: NaN or the largest code; None if the field always has a value."""
        if not self.unit or self.always_available or self.constant is not None:
            return None
        return math.nan if self.wire is WireType.F32 else self.wire.max_code

    @property
    def max_value_code(self) -> int:
        """Return the largest integer code of a value.

        The largest code of the wire type is excluded if it is the not-available code.
        """
        assert self.wire.max_code is not None
        return self.wire.max_code - (self.not_available is not None)

    def encode(self, value: object) -> float:
        """Return the wire code of a quantity's value: a float for F32, otherwise an integer.

        NaN gives the not-available code. Scaled integers saturate; counters wrap.
        """
        if self.bits:
            return self.bits.code(value)  # type: ignore[arg-type]
        if self.values:
            return self.values.codes[value]  # type: ignore[index]
        number = float(value) * self.scale if self.unit else value  # type: ignore[arg-type]
        if self.wire is WireType.F32:
            return number  # type: ignore[return-value]
        return self._encode_integer(number)  # type: ignore[arg-type]

    def _encode_integer(self, number: float) -> int:
        assert self.wire.min_code is not None
        assert self.wire.max_code is not None
        if not self.unit:
            return int(number) & self.wire.max_code if self.wire.min_code == 0 else int(number)
        if math.isnan(number):
            return self.wire.max_code if self.not_available is None else int(self.not_available)
        return round(min(max(number, self.wire.min_code), self.max_value_code))

    def decode(self, code: float) -> float | str | frozenset[str]:
        """Return the value of a wire code.

        The value is a number in the quantity's unit (NaN if not available), the name of an enumeration's
        code, or the set of names of a bit field.
        """
        if self.bits:
            return self.bits.names(int(code))
        if self.values:
            return self.values.names.get(int(code), f"{int(code)}?")
        if code == self.not_available:
            return math.nan
        return code / self.scale if self.unit else code

    def accepts(self, code: float) -> bool:
        """Return True if a written code is within the range, or is a code of the enumeration.

        NaN and infinity are not accepted if the field has a range.
        """
        if self.values:
            return code in self.values.names
        if code in self.also_allowed:
            return True
        return self.low is None or self.high is None or self.low <= code <= self.high

    def describe(self, code: float) -> str:
        """Return the name of the field and a value in words, for example "setpoint_pa 8000 Pa"."""
        text = float32_text(code) if self.wire is WireType.F32 else f"{code:.9g}"
        value = self.values.names.get(int(code), text) if self.values else text
        return f"{self.name} {value} {self.unit}".rstrip()

    @property
    def allowed_values(self) -> str:
        """Return which values may be written, in words, for example "must be from 2 to 12 kPa"."""
        if self.values:
            return "must be one of " + ", ".join(self.values.codes)
        if self.low is None:
            return f"must be an integer from {self.wire.min_code} to {self.wire.max_code}"
        if self.low == self.high:
            return f"must be {self.low:g} {self.unit}".rstrip()
        also = "".join(f", or {value:g}" for value in self.also_allowed)
        return f"must be from {self.low:g} to {self.high:g} {self.unit}".rstrip() + also

    def with_wire_type(self, wire: WireType, unit: str = "", name: str = "") -> Field:
        """Return a field for the same quantity in another wire type and unit."""
        factor = UNITS[unit][1] / self.scale if unit else 1.0
        return replace(
            self,
            name=name or self.name,
            wire=wire,
            unit=unit,
            low=None if self.low is None else self.low * factor,
            high=None if self.high is None else self.high * factor,
        )
