"""An entry of the object dictionary: its type, access and limits, and what a written value must keep to."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from registers.canopen.abort import Abort, Why
from registers.field import Field

Code = int | float | str


class Type(Enum):
    """A data type: its number (CiA 301, table 44), its `struct` code and its size; a text has no size."""

    I16 = (0x0003, "<h", 2)
    U8 = (0x0005, "<B", 1)
    U16 = (0x0006, "<H", 2)
    U32 = (0x0007, "<I", 4)
    F32 = (0x0008, "<f", 4)
    TEXT = (0x0009, "", 0)

    def __init__(self, number: int, layout: str, size: int) -> None:
        self.number = number
        self.layout = layout
        self.size = size


class Kind(Enum):
    """What an object is made of (CiA 301, table 42)."""

    VAR = 7
    ARRAY = 8
    RECORD = 9


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """One value at an index and sub-index.

    `field` binds it to a quantity of the source; `default` makes it a communication parameter; what has
    neither is made by the node. `access` is const, ro, rw, or rww (written by a PDO).
    """

    index: int
    sub: int = 0
    name: str
    type: Type
    access: str = "ro"
    doc: str = ""
    field: Field | None = None
    default: int | None = None
    plus_node_id: bool = False  #: the node id comes on top of the default
    low: float | None = None
    high: float | None = None
    allowed: Callable[[int, int], bool] | None = None  #: of a written value and the node id
    mappable: bool = False

    @property
    def at(self) -> tuple[int, int]:
        """Index and sub-index."""
        return self.index, self.sub

    @property
    def writable(self) -> bool:
        """Whether it can be written at all."""
        return self.access in ("rw", "rww")

    def encode(self, code: Code) -> bytes:
        """Bytes of a value, little-endian; a number that float32 cannot hold is not available."""
        if isinstance(code, str):
            return code.encode("ascii", "replace")
        try:
            return struct.pack(self.type.layout, code)
        except OverflowError:
            return struct.pack(self.type.layout, math.nan)

    def decode(self, raw: bytes, node_id: int) -> float:
        """The value that was written. Raises Abort: of a wrong length, not finite, or outside its limits."""
        if len(raw) != self.type.size:
            raise Abort(Why.TOO_LONG if len(raw) > self.type.size else Why.TOO_SHORT)
        (code,) = struct.unpack(self.type.layout, raw)
        if not math.isfinite(code):
            raise Abort(Why.VALUE)
        if self.high is not None and code > self.high:
            raise Abort(Why.TOO_HIGH)
        if self.low is not None and code < self.low:
            raise Abort(Why.TOO_LOW)
        if self.field is not None and not self.field.accepts(code):
            raise Abort(Why.VALUE)
        if self.allowed is not None and not self.allowed(code, node_id):
            raise Abort(Why.VALUE)
        return float(code) if self.type is Type.F32 else int(code)


@dataclass(frozen=True, slots=True, kw_only=True)
class Object:
    """An index with its entries; a VAR has one, an ARRAY or RECORD as many as sub-index 0 says, and that."""

    index: int
    name: str
    kind: Kind
    entries: tuple[Entry, ...]


def of_field(field: Field, index: int, sub: int = 0, *, access: str = "ro", mappable: bool = False) -> Entry:
    """The entry of a register, or of a field of a frame."""
    low, high = _limits(field)
    return Entry(
        index=index,
        sub=sub,
        name=field.name,
        type=Type[field.wire.name],
        access=access,
        doc=f"{field.doc} [{field.unit}]" if field.unit else field.doc,
        field=field,
        low=low,
        high=high,
        mappable=mappable,
    )


def _limits(field: Field) -> tuple[float | None, float | None]:
    if field.values:
        return min(field.values.names), max(field.values.names)
    if field.low is None or field.high is None:
        return None, None
    return min((field.low, *field.also)), field.high
