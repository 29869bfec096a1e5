"""Parser for write requests that name registers instead of addresses."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pneuforce.registers.field import WireType
from pneuforce.registers.map import BY_NAME, Register

#: Larger than the range of every register. The comparison with this limit also excludes NaN.
_MAX_MAGNITUDE = 1e30


class MalformedWriteRequest(ValueError):
    """Write request that is rejected before it reaches the instrument.

    `written` names the register and the value, and `allowed` states what is allowed.
    """

    def __init__(self, written: str, allowed: str) -> None:
        super().__init__(f"{written}: {allowed}")
        self.written = written
        self.allowed = allowed


def parse_write_request(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the quantities and their new values for a request that maps register names to values.

    Each value is a number in the register's unit, or the name of a code. Raises MalformedWriteRequest in
    the cases in which a Modbus client receives exception 02 or 03: the register is unknown or read-only, or
    the value is not a number, not finite, out of range or not a code of the enumeration. An empty request is
    also malformed.
    """
    if not values:
        raise MalformedWriteRequest("no values", "name at least one register")
    return dict(_parse_value(name, value) for name, value in values.items())


def _parse_value(name: str, value: Any) -> tuple[str, Any]:
    register = BY_NAME.get(name)
    if register is None:
        raise MalformedWriteRequest(name, "unknown register")
    if not register.writable:
        raise MalformedWriteRequest(name, "the register is read-only")
    code = _code(register, value)
    if not register.accepts(code):
        raise MalformedWriteRequest(f"{name} = {value}", register.allowed_values)
    return register.quantity, register.decode(code)


def _code(register: Register, value: Any) -> float:
    if isinstance(value, str) and register.values and value in register.values.codes:
        return register.values.codes[value]
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < _MAX_MAGNITUDE:
        raise MalformedWriteRequest(f"{register.name} = {value!r}", register.allowed_values)
    if register.wire is WireType.F32:
        return float(value)
    integer = int(value)
    assert register.wire.min_code is not None
    assert register.wire.max_code is not None
    if integer != value or not register.wire.min_code <= integer <= register.wire.max_code:
        raise MalformedWriteRequest(f"{register.name} = {value}", register.allowed_values)
    return integer
