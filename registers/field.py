"""A field: one quantity as it travels on a wire, its type, unit, span and not-available code."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property

#: Wire unit → (suffix of the quantity that carries it, wire counts per quantity unit).
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


def plain_unit(unit: str) -> str:
    """The unit of the quantity that a wire unit carries: N for mN; "" for none."""
    suffix = UNITS[unit][0] if unit else None
    return next((plain for plain, carried in UNITS.items() if carried == (suffix, 1.0)), "")


class Wire(Enum):
    """How a value lies in memory: its `struct` code, its size and the largest code it has."""

    F32 = ("f", 4, None, None)
    U32 = ("I", 4, 0, 0xFFFF_FFFF)
    I16 = ("h", 2, -0x8000, 0x7FFF)
    U16 = ("H", 2, 0, 0xFFFF)
    U8 = ("B", 1, 0, 0xFF)

    def __init__(self, code: str, size: int, lowest: int | None, highest: int | None) -> None:
        self.code = code
        self.size = size
        self.lowest = lowest
        self.highest = highest

    @property
    def words(self) -> int:
        """Number of 16-bit Modbus words."""
        return (self.size + 1) // 2


@dataclass(frozen=True, slots=True)
class Bit:
    """One named condition in a bit field."""

    number: int
    name: str
    doc: str
    latches: bool = False  #: stays until cleared by command once its cause is gone


@dataclass(frozen=True, eq=False)
class Bits:
    """A bit field: which named condition stands at which bit."""

    bits: tuple[Bit, ...]

    @cached_property
    def _masks(self) -> Mapping[str, int]:
        return {bit.name: 1 << bit.number for bit in self.bits}

    def code(self, names: Iterable[str]) -> int:
        """Word with the bits of `names` set; names that have no bit here are passed over."""
        return sum(self._masks.get(name, 0) for name in names)

    def names(self, code: int) -> frozenset[str]:
        """Names of the bits set in `code`."""
        return frozenset(bit.name for bit in self.bits if code >> bit.number & 1)


@dataclass(frozen=True, eq=False)
class Values:
    """An enumeration: the name of each code."""

    names: Mapping[int, str]

    @cached_property
    def codes(self) -> Mapping[str, int]:
        """Code of each name."""
        return {name: code for code, name in self.names.items()}


@dataclass(frozen=True, slots=True, kw_only=True)
class Field:
    """One value on a wire, bound by name to a quantity of the source.

    Exactly one of `quantity` and `constant` is given. `values` names the codes of an enumeration and
    `bits` the conditions of a bit field: their quantity is a name, or a set of names. `legend` says in words
    what a number stands for; it stays a number, for a board may know one that has no word here.
    """

    name: str
    wire: Wire
    doc: str
    quantity: str = ""
    constant: float | None = None
    unit: str = ""
    low: float | None = None  #: least accepted or meaningful value, in `unit`
    high: float | None = None  #: greatest accepted or meaningful value, in `unit`
    also: tuple[float, ...] = ()  #: accepted values outside the span
    always: bool = False  #: an age or a set time: has a unit, yet no not-available code
    values: Values | None = None
    bits: Bits | None = None
    legend: Values | None = None

    @property
    def code_names(self) -> Mapping[int, str]:
        """What the codes are called, empty for what is no enumeration."""
        named = self.values or self.legend
        return named.names if named else {}

    @property
    def scale(self) -> float:
        """Wire counts per unit of the quantity."""
        return UNITS[self.unit][1] if self.unit else 1.0

    @property
    def not_available(self) -> float | None:
        """The code that says "no value": NaN, 7FFFh or FFFFh; None where the field always has a value."""
        if not self.unit or self.always or self.constant is not None:
            return None
        return math.nan if self.wire is Wire.F32 else self.wire.highest

    @property
    def largest(self) -> int:
        """Greatest integer code of a value: scaled values saturate one short of the not-available code."""
        assert self.wire.highest is not None
        return self.wire.highest - (self.not_available is not None)

    def encode(self, value: object) -> float:
        """Wire code of a quantity's value: float for F32, else int; NaN gives the not-available code."""
        if self.bits:
            return self.bits.code(value)  # type: ignore[arg-type]
        if self.values:
            return self.values.codes[value]  # type: ignore[index]
        number = float(value) * self.scale if self.unit else value  # type: ignore[arg-type]
        if self.wire is Wire.F32:
            return number  # type: ignore[return-value]
        return self._integer(number)  # type: ignore[arg-type]

    def _integer(self, number: float) -> int:
        assert self.wire.lowest is not None
        assert self.wire.highest is not None
        if not self.unit:
            return int(number) & self.wire.highest if self.wire.lowest == 0 else int(number)  # counters wrap
        if number != number:
            return self.wire.highest if self.not_available is None else int(self.not_available)
        return round(min(max(number, self.wire.lowest), self.largest))

    def decode(self, code: float) -> float | str | frozenset[str]:
        """Value of a wire code: a number in the quantity's unit (NaN: not available), a name, or names."""
        if self.bits:
            return self.bits.names(int(code))
        if self.values:
            return self.values.names.get(int(code), f"{int(code)}?")
        if code == self.not_available:
            return math.nan
        return code / self.scale if self.unit else code

    def accepts(self, code: float) -> bool:
        """Whether a written code is finite and within the span, or one of the codes named by `values`."""
        if self.values:
            return code in self.values.names
        if code in self.also:
            return True
        return self.low is None or self.high is None or self.low <= code <= self.high

    def on_wire(self, wire: Wire, unit: str = "", name: str = "") -> Field:
        """The same quantity in another wire type and unit."""
        factor = self._factor_to(unit)
        return replace(
            self,
            name=name or self.name,
            wire=wire,
            unit=unit,
            low=None if self.low is None else self.low * factor,
            high=None if self.high is None else self.high * factor,
        )

    def _factor_to(self, unit: str) -> float:
        return UNITS[unit][1] / self.scale if unit else 1.0
