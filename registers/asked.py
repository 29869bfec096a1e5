"""Requests that name registers, instead of words at addresses: what they ask, or what is wrong with them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from registers.field import Wire
from registers.map import BY_NAME, Register

_BEYOND_ANY = 1e30  #: further than any register goes; NaN is not below it either


class Malformed(ValueError):
    """A request that no instrument is asked, in a sentence."""


def asked(values: Mapping[str, Any]) -> dict[str, Any]:
    """Quantities and their new values, of values in each register's own unit or the names of codes.

    What a Modbus client gets an exception 02 or 03 for raises Malformed: an unknown register or a read-only
    one, a number that is none, is not finite, is out of its span or has no code.
    """
    if not values:
        raise Malformed("nothing is asked")
    return dict(_asked(name, value) for name, value in values.items())


def _asked(name: str, value: Any) -> tuple[str, Any]:
    register = BY_NAME.get(name)
    if register is None or not register.writable:
        raise Malformed(f"{name}: no register that can be written")
    code = _code(register, value)
    if not register.accepts(code):
        raise Malformed(f"{name} = {value}: {_allowed(register)}")
    return register.quantity, register.decode(code)


def _code(register: Register, value: Any) -> float:
    if isinstance(value, str) and register.values and value in register.values.codes:
        return register.values.codes[value]
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < _BEYOND_ANY:
        raise Malformed(f"{register.name} = {value!r}: {_allowed(register)}")
    if register.wire is Wire.F32:
        return float(value)
    whole = int(value)
    assert register.wire.lowest is not None
    assert register.wire.highest is not None
    if whole != value or not register.wire.lowest <= whole <= register.wire.highest:
        raise Malformed(f"{register.name} = {value}: {_allowed(register)}")
    return whole


def _allowed(register: Register) -> str:
    if register.values:
        return "one of " + ", ".join(register.values.codes)
    if register.low is None:
        return f"a whole number from {register.wire.lowest} to {register.wire.highest}"
    also = "".join(f", or {value:g}" for value in register.also)
    return f"from {register.low:g} to {register.high:g} {register.unit}".rstrip() + also
