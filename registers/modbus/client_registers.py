"""Registers as the Modbus client shows them: by name, and each quantity once."""

from __future__ import annotations

from difflib import get_close_matches

from pneuforce.registers.document_text import ascii_text, format_range
from pneuforce.registers.field import quantity_unit
from pneuforce.registers.map import BY_NAME, REGISTERS, Register
from pneuforce.registers.modbus.client_errors import ModbusClientError


def repeats_quantity(register: Register) -> bool:
    """Return True if the register's name ends in a unit that differs from the quantity's unit.

    For example, the value of pressure_pa is decoded to kPa, so its name would be misleading.
    """
    unit = ascii_text(register.unit)
    return unit != quantity_unit(register.unit) and register.name.endswith(f"_{unit.lower()}")


def writable_register(name: str) -> Register:
    """Return the register `name`. Raises ModbusClientError if it cannot be written."""
    if name not in BY_NAME:
        matches = get_close_matches(name, [register.name for register in REGISTERS if register.writable])
        hint = f"; similar: {', '.join(matches)}" if matches else ""
        raise ModbusClientError(f"{name}: unknown register{hint}")
    if repeats_quantity(BY_NAME[name]):
        raise ModbusClientError(f"{name} repeats another register: write {name.rpartition('_')[0]} instead")
    if not BY_NAME[name].writable:
        requested = f"{name}_requested"
        hint = f": write {requested} instead" if requested in BY_NAME else ""
        raise ModbusClientError(f"{name} is read-only{hint}")
    return BY_NAME[name]


def allowed_values(register: Register) -> str:
    """Return the allowed values of a register as the end of an error message."""
    if register.values:
        return f"; allowed: {', '.join(register.values.codes)}"
    unit = quantity_unit(register.unit)
    allowed = format_range(register.with_wire_type(register.wire, unit))
    return f"; allowed: {allowed} {unit}".rstrip() if allowed else ""
