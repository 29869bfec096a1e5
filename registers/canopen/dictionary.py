"""OBJECTS: the whole object dictionary. Register 512 is object 2200h: 2000h plus its address."""

from __future__ import annotations

from registers.can.frames import COMMAND, Frame
from registers.canopen.abort import Abort, Why
from registers.canopen.communication import COMMUNICATION, RECORDS, TPDOS, compound
from registers.canopen.entry import Entry, Kind, Object, Type, of_field
from registers.map import BY_NAME, REGISTERS, Register

REGISTERS_AT = 0x2000
#: Physical units of CiA 303-2: a prefix, then the code of the unit.
NEWTON, KILOPASCAL = 0x0021_0000, 0x0322_0000
AI_STATUS = 0x6150  #: bit 0: not valid; bit 1: above the range


def index_of(register: Register) -> int:
    """Index of a register's object."""
    return REGISTERS_AT + register.address


def _register(register: Register) -> Object:
    access = "rw" if register.writable else "const" if register.constant is not None else "ro"
    entry = of_field(register, index_of(register), access=access)
    return Object(index=entry.index, name=register.name, kind=Kind.VAR, entries=(entry,))


def _record(frame: Frame) -> Object:
    """The fields of a frame, as its PDO maps them."""
    index, access = RECORDS[frame.name], "rww" if frame.received else "ro"
    entries = tuple(
        of_field(field, index, sub, access=access, mappable=True) for sub, field in enumerate(frame.fields, 1)
    )
    return compound(index, frame.name, entries)


def _channels(index: int, name: str, force: Entry, pressure: Entry) -> Object:
    return compound(index, name, (force, pressure), Kind.ARRAY)


def _constants(index: int, name: str, of: Type, force: int, pressure: int) -> Object:
    return _channels(
        index,
        name,
        Entry(index=index, sub=1, name="force", type=of, access="const", default=force),
        Entry(index=index, sub=2, name="pressure", type=of, access="const", default=pressure),
    )


def _measured(index: int, name: str, force: str, pressure: str) -> Object:
    return _channels(index, name, of_field(BY_NAME[force], index, 1), of_field(BY_NAME[pressure], index, 2))


_MEASURING: tuple[Object, ...] = (
    _measured(0x6130, "AI process value", "force", "pressure"),
    _constants(0x6131, "AI physical unit process value", Type.U32, NEWTON, KILOPASCAL),
    _constants(0x6132, "AI decimal digits process value", Type.U8, 3, 3),
    _channels(
        AI_STATUS,
        "AI status",
        Entry(index=AI_STATUS, sub=1, name="force", type=Type.U8, doc="Bit 0: not valid; 1: force limit."),
        Entry(
            index=AI_STATUS, sub=2, name="pressure", type=Type.U8, doc="Bit 0: not valid; 1: overpressure."
        ),
    ),
    _measured(0x7130, "AI process value, 16 bits", "force_mn", "pressure_pa"),
)

OBJECTS: tuple[Object, ...] = tuple(
    sorted(
        (
            *COMMUNICATION,
            *(_register(register) for register in REGISTERS),
            *(_record(tpdo[0]) for tpdo in TPDOS),
            _record(COMMAND),
            *_MEASURING,
        ),
        key=lambda made: made.index,
    )
)

BY_INDEX = {made.index: made for made in OBJECTS}
ENTRIES: tuple[Entry, ...] = tuple(entry for made in OBJECTS for entry in made.entries)
_BY_PLACE = {entry.at: entry for entry in ENTRIES}


def entry_at(index: int, sub: int) -> Entry:
    """The entry at an index and sub-index. Raises Abort where there is none."""
    entry = _BY_PLACE.get((index, sub))
    if entry is None:
        raise Abort(Why.NO_SUB_INDEX if index in BY_INDEX else Why.NO_OBJECT)
    return entry
