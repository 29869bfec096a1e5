"""Registers as the Modbus client shows them: by name, and each quantity once."""

from __future__ import annotations

from difflib import get_close_matches

from pneuforce.registers.document_text import ascii_text, format_range
from pneuforce.registers.field import quantity_unit
from pneuforce.registers.map import BY_NAME, Register
from pneuforce.registers.modbus.client_errors import ModbusClientError


def repeats_quantity(register: Register) -> bool:
    """Return True if the register's name ends in a unit that differs from the quantity's unit.

    For example, the value of pressure_pa is decoded to kPa, so its name would be misleading.
    """
    unit = ascii_text(register.unit)
    return unit != quantity_unit(register.unit) and register.name.endswith(f"_{unit.lower()}")


def writable_register(name: str) -> Register:
    """Return the register `name`. Raises ModbusClientError if it cannot be written."""
    if str(name) not in BY_NAME:  # Python does not check the types of a caller
        matches = filter(None, map(_writable_name, get_close_matches(str(name), BY_NAME)))
        hint = "; similar: " + ", ".join(dict.fromkeys(matches))
        raise ModbusClientError(f"{name}: unknown register{hint}".removesuffix("; similar: "))
    other = _writable_name(name)
    hint = f": write {other} instead" if other and other != name else ""
    if repeats_quantity(BY_NAME[name]):
        raise ModbusClientError(f"{name} repeats another register{hint}")
    if not BY_NAME[name].writable:
        raise ModbusClientError(f"{name} is read-only{hint}")
    return BY_NAME[name]


def _writable_name(name: str) -> str | None:
    """Return the register to write for the quantity `name`, or None if the quantity cannot be written."""
    quantity = name.rpartition("_")[0] if repeats_quantity(BY_NAME[name]) else name
    names = (quantity, f"{quantity}_requested")
    return next((each for each in names if each in BY_NAME and BY_NAME[each].writable), None)


def allowed_values(register: Register) -> str:
    """Return the allowed values of a register as the end of an error message."""
    if register.values:
        return f"; allowed: {', '.join(register.values.codes)}"
    unit = quantity_unit(register.unit)
    allowed = format_range(register.with_wire_type(register.wire, unit))
    return f"; allowed: {allowed} {unit}".rstrip() if allowed else ""
