"""Tests of the line and of the table of `pneuforce watch modbus`."""

import math

import pytest
from rich.console import Console

from pneuforce.instrument.cli.watch.watch_modbus import named, register_table, text_line
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
        console.print(register_table(values(-12.345) | {"status": several_bits}, console))
    lines = captured.get().splitlines()
    assert len(lines) < 24
    assert max(map(len, lines)) <= 80
    assert "…" not in captured.get()
    assert lines[-1].split() == ["778", "first_out_fault", "none"]
    assert lines[0].split()[:3] == ["0", "force", "-12.345"]


@pytest.mark.parametrize(("code", "name"), [(0, "none"), (5, "burst"), (999, "999")])
def test_json_contains_the_name_of_the_first_out_fault(code, name):
    read = values(1.0) | {"first_out_fault": code}
    assert named(read) == read | {"first_out_fault": name}


@pytest.mark.parametrize("width", range(4, 100, 3))
def test_a_narrow_terminal_cuts_no_digit_off_a_value(width):
    console = Console(width=width, height=24)
    shown = values(-12.345) | {"sample_counter": 4294967295, "lease": 65.535, "contact_counter": 65535}
    with console.capture() as captured:
        console.print(register_table(shown, console))
    unwrapped = "".join(captured.get().split())
    assert "force-12.345N" in unwrapped
    assert "contact_counter65535" in unwrapped
    assert ("sample_counter" in unwrapped) == ("sample_counter4294967295" in unwrapped)
    assert ("lease" in unwrapped) == ("lease65535ms" in unwrapped)
