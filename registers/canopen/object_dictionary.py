"""Object dictionary of the node. Register n is object 2000h + n, so register 512 is object 2200h."""

from __future__ import annotations

from pneuforce.registers.can.frames import COMMAND, FrameDefinition
from pneuforce.registers.canopen.abort import AbortCode, SdoAbort
from pneuforce.registers.canopen.communication import COMMUNICATION, RECORDS, TPDOS, compound, mapped_fields
from pneuforce.registers.canopen.entry import (
    DictionaryObject,
    ObjectCode,
    ObjectEntry,
    entry_of_field,
)
from pneuforce.registers.canopen.measuring_device import MEASURING_DEVICE
from pneuforce.registers.map import REGISTERS, Register

REGISTER_INDEX_BASE = 0x2000


def register_index(register: Register) -> int:
    """Return the index of a register's object."""
    return REGISTER_INDEX_BASE + register.address


def _register(register: Register) -> DictionaryObject:
    access = "rw" if register.writable else "const" if register.constant is not None else "ro"
    entry = entry_of_field(register, register_index(register), access=access)
    return DictionaryObject(
        index=entry.index, name=register.name, object_code=ObjectCode.VAR, entries=(entry,)
    )


def _record(frame: FrameDefinition) -> DictionaryObject:
    """Return the record with the fields of a frame. A field is mappable if the frame's PDO maps it."""
    index, access = RECORDS[frame.name], "rww" if frame.received else "ro"
    entries = tuple(
        entry_of_field(field, index, subindex, access=access, mappable=mapped == (index, subindex))
        for subindex, (field, mapped) in enumerate(mapped_fields(frame), 1)
    )
    return compound(index, frame.name, entries)


OBJECTS: tuple[DictionaryObject, ...] = tuple(
    sorted(
        (
            *COMMUNICATION,
            *(_register(register) for register in REGISTERS),
            *(_record(tpdo[0]) for tpdo in TPDOS),
            _record(COMMAND),
            *MEASURING_DEVICE,
        ),
        key=lambda object_: object_.index,
    )
)

BY_INDEX = {object_.index: object_ for object_ in OBJECTS}
ENTRIES: tuple[ObjectEntry, ...] = tuple(entry for object_ in OBJECTS for entry in object_.entries)
_BY_ADDRESS = {entry.address: entry for entry in ENTRIES}


def entry_at(index: int, subindex: int) -> ObjectEntry | None:
    """Return the entry at an index and sub-index; None if it does not exist."""
    return _BY_ADDRESS.get((index, subindex))


def find_entry(index: int, subindex: int) -> ObjectEntry:
    """Return the entry at an index and sub-index. Raises SdoAbort if it does not exist."""
    entry = entry_at(index, subindex)
    if entry is None:
        raise SdoAbort(AbortCode.NO_SUBINDEX if index in BY_INDEX else AbortCode.NO_OBJECT)
    return entry
