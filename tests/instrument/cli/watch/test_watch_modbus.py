"""Tests of the line and of the table of `pneuforce watch modbus`."""

import math

import pytest
from rich.console import Console

from pneuforce.instrument.cli.watch.watch_modbus import register_table, text_line
from pneuforce.registers.codes import STATUS
from pneuforce.registers.field import WireType
from pneuforce.registers.map import BY_NAME

CODES = {"state": "inflating", "reject_reason": "none", "status": frozenset()}


def values(number):
    """Return values of all registers. Each measured value is `number`."""
    return {
        name: CODES.get(name, number if register.wire is WireType.F32 else register.decode(0))
        for name, register in BY_NAME.items()
    }


@pytest.mark.parametrize("number", [-0.5, 12.345, math.nan])
def test_every_line_has_the_same_columns(number):
    names = ("force", "force_uncertainty", "pressure", "contact_counter", "state", "status")
    columns = {
        tuple(line.index(f"{name} ") for name in names) for line in map(text_line, map(values, (0.0, number)))
    }
    assert len(columns) == 1


def test_the_table_fits_into_a_small_terminal():
    console = Console(width=80, height=24)
    several_bits = frozenset(bit.name for bit in STATUS.bits[:6])
    with console.capture() as captured:
        console.print(register_table(values(-12.345) | {"status": several_bits}))
    lines = captured.get().splitlines()
    assert len(lines) < 24
    assert max(map(len, lines)) <= 80
    assert "…" not in captured.get()
    assert lines[-1].split() == ["778", "first_out_fault", "none"]
    assert lines[0].split()[:3] == ["0", "force", "-12.345"]
