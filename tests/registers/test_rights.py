"""Tests of the rights of roles."""

from pneuforce.registers.map import REGISTERS
from pneuforce.registers.rights import DEFAULT_ROLES, RIGHTS, writable_quantities


def test_each_writable_quantity_belongs_to_one_right():
    groups = sorted(name for quantities in RIGHTS.values() for name in quantities)
    assert groups == sorted({register.quantity for register in REGISTERS if register.writable})


def test_a_viewer_writes_nothing_and_an_operator_everything():
    assert writable_quantities(DEFAULT_ROLES["viewer"]) == frozenset()
    assert len(writable_quantities(DEFAULT_ROLES["operator"])) == sum(map(len, RIGHTS.values()))
