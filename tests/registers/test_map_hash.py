"""Tests of the hash of the map: it changes with each declared value on each bus, but not with a text."""

from dataclasses import fields, replace

import pytest

from pneuforce.registers.can.frames import COMMAND_MODES, FORCE, FRAMES
from pneuforce.registers.canopen.communication import revision_number
from pneuforce.registers.canopen.object_dictionary import ENTRIES, OBJECTS
from pneuforce.registers.codes import STATUS
from pneuforce.registers.field import BitField, Enumeration
from pneuforce.registers.map import MAP_VERSION, REGISTERS
from pneuforce.registers.map_hash import MAP_HASH, hash_of

FRAME_FIELDS = [field for frame in FRAMES for field in frame.fields]
DECLARATIONS = [*REGISTERS, *FRAMES, *FRAME_FIELDS, *OBJECTS, *ENTRIES]


def changes(declaration):
    """Yield the name of each value, and the declaration with another value there."""
    for field in fields(declaration):
        before = getattr(declaration, field.name)
        if field.name != "doc" and not callable(before):
            yield field.name, replace(declaration, **{field.name: "another" if before is None else None})


@pytest.mark.parametrize("declaration", DECLARATIONS, ids=lambda declaration: declaration.name)
def test_each_value_of_a_declaration_changes_the_hash(declaration):
    unchanged = [
        name for name, changed in changes(declaration) if hash_of([changed]) == hash_of([declaration])
    ]
    assert not unchanged


@pytest.mark.parametrize("declaration", [*REGISTERS, *FRAMES, *FRAME_FIELDS], ids=lambda d: d.name)
def test_a_text_for_people_does_not_change_the_hash(declaration):
    assert hash_of([replace(declaration, doc="another text")]) == hash_of([declaration])


def test_two_exchanged_signals_of_a_frame_change_the_hash():
    force, pressure, *others = FORCE.fields
    assert hash_of(replace(FORCE, fields=(pressure, force, *others))) != hash_of(FORCE)


def test_two_exchanged_codes_change_the_hash():
    names = dict(COMMAND_MODES.names)
    names[0], names[1] = names[1], names[0]
    assert hash_of(Enumeration(names)) != hash_of(COMMAND_MODES)


@pytest.mark.parametrize("change", [{"number": 31}, {"name": "another"}, {"latches": True}])
def test_each_value_of_a_status_bit_changes_the_hash(change):
    first, *others = STATUS.bits
    assert hash_of(BitField((replace(first, **change), *others))) != hash_of(STATUS)


def test_the_order_of_codes_in_the_source_does_not_change_the_hash():
    assert hash_of(Enumeration({1: "b", 0: "a"})) == hash_of(Enumeration({0: "a", 1: "b"}))


def test_the_revision_of_the_canopen_identity_contains_version_and_hash():
    revision = revision_number(MAP_HASH)
    assert (revision >> 16, revision & 0xFFFF) == (MAP_VERSION, MAP_HASH & 0xFFFF)
