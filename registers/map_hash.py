"""Hash over all that is declared for Modbus, CAN and CANopen.

An instrument and a document belong together if their hashes are equal.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum

from pneuforce.registers.can.frames import FRAMES
from pneuforce.registers.canopen.communication import EVENT_DRIVEN, SYNCHRONOUS
from pneuforce.registers.canopen.object_dictionary import OBJECTS
from pneuforce.registers.map import BLOCKS, COMMAND_KEY, MAP_VERSION, REGISTERS


def hash_of(*declarations: object) -> int:
    """Return the CRC-32 of the declarations. It depends on all values, but not on the texts for people."""
    return zlib.crc32(repr(_facts(declarations)).encode())


def _facts(declared: object) -> object:
    if isinstance(declared, Enum):
        return declared.name
    if is_dataclass(declared):
        return [(f.name, _facts(getattr(declared, f.name))) for f in fields(declared) if f.name != "doc"]
    if isinstance(declared, Mapping):
        return sorted((_facts(key), _facts(value)) for key, value in declared.items())
    if isinstance(declared, Iterable) and not isinstance(declared, str):
        return [_facts(item) for item in declared]
    return None if callable(declared) else declared


MAP_HASH = hash_of(MAP_VERSION, COMMAND_KEY, BLOCKS, REGISTERS, FRAMES, OBJECTS, SYNCHRONOUS, EVENT_DRIVEN)
