"""Entries of the object dictionary: data type, access, limits, and the check of a written value."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from pneuforce.registers.canopen.abort import AbortCode, SdoAbort
from pneuforce.registers.field import Field

#: Value of an entry: a wire code or a text.
EntryValue = int | float | str
EntryAddress = tuple[int, int]  #: index and sub-index


class DataType(Enum):
    """Data type: number (CiA 301, table 44), `struct` format, and size [bytes]. A text has the size 0."""

    I16 = (0x0003, "<h", 2)
    I32 = (0x0004, "<i", 4)
    U8 = (0x0005, "<B", 1)
    U16 = (0x0006, "<H", 2)
    U32 = (0x0007, "<I", 4)
    F32 = (0x0008, "<f", 4)
    TEXT = (0x0009, "", 0)

    def __init__(self, number: int, layout: str, size: int) -> None:
        self.number = number
        self.layout = layout
        self.size = size


class ObjectCode(Enum):
    """Object code (CiA 301, table 42)."""

    VAR = 7
    ARRAY = 8
    RECORD = 9


@dataclass(frozen=True, slots=True, kw_only=True)
class ObjectEntry:
    """One value at an index and sub-index.

    An entry with a `field` is a quantity of the source. An entry with a `default` is a communication
    parameter. The node itself supplies the value of any other entry.
    """

    index: int
    subindex: int = 0
    name: str
    type: DataType
    access: str = "ro"  #: const, ro, wo, rw, or rww (written by a PDO)
    doc: str = ""
    field: Field | None = None
    default: int | None = None
    adds_node_id: bool = False  #: the node id is added to the default
    low: float | None = None
    high: float | None = None
    #: Check of a written value: called with the value and the node id, returns True if the value is allowed.
    allowed: Callable[[int, int], bool] | None = None
    mappable: bool = False

    @property
    def address(self) -> EntryAddress:
        """Return the index and the sub-index."""
        return self.index, self.subindex

    @property
    def readable(self) -> bool:
        """Return True if the entry can be read."""
        return self.access != "wo"

    @property
    def writable(self) -> bool:
        """Return True if the entry can be written."""
        return self.access in ("wo", "rw", "rww")

    def encode(self, value: EntryValue) -> bytes:
        """Return the bytes of a value, little-endian. A number that is too large for float32 becomes NaN."""
        if isinstance(value, str):
            return value.encode("ascii", "replace")
        try:
            return struct.pack(self.type.layout, value)
        except OverflowError:
            return struct.pack(self.type.layout, math.nan)

    def decode(self, raw: bytes, node_id: int) -> float:
        """Return the written value.

        Raises SdoAbort if the length is wrong, or if the value is not finite or not allowed.
        """
        if len(raw) != self.type.size:
            raise SdoAbort(AbortCode.TOO_LONG if len(raw) > self.type.size else AbortCode.TOO_SHORT)
        (value,) = struct.unpack(self.type.layout, raw)
        if not math.isfinite(value):
            raise SdoAbort(AbortCode.INVALID_VALUE)
        if self.high is not None and value > self.high:
            raise SdoAbort(AbortCode.TOO_HIGH)
        if self.low is not None and value < self.low:
            raise SdoAbort(AbortCode.TOO_LOW)
        if self.field is not None and not self.field.accepts(value):
            raise SdoAbort(AbortCode.INVALID_VALUE)
        if self.allowed is not None and not self.allowed(value, node_id):
            raise SdoAbort(AbortCode.INVALID_VALUE)
        return float(value) if self.type is DataType.F32 else int(value)


@dataclass(frozen=True, slots=True, kw_only=True)
class DictionaryObject:
    """Object of the dictionary: an index with its entries.

    A VAR has one entry. An ARRAY or a RECORD has an entry at sub-index 0 and at least one other entry.
    """

    index: int
    name: str
    object_code: ObjectCode
    entries: tuple[ObjectEntry, ...]


def entry_of_field(
    field: Field, index: int, subindex: int = 0, *, access: str = "ro", mappable: bool = False
) -> ObjectEntry:
    """Return the entry of a register, or of a field of a frame."""
    low, high = _limits(field)
    return ObjectEntry(
        index=index,
        subindex=subindex,
        name=field.name,
        type=DataType[field.wire.name],
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
    return min((field.low, *field.also_allowed)), field.high
