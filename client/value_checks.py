"""Checks of the values that a program passes to the client, before anything is sent."""

from __future__ import annotations

from numbers import Real

from pneuforce.errors import ConfigurationError
from pneuforce.registers.field import Field
from pneuforce.registers.map import BY_NAME


def check_setpoint(setpoint_kpa: float) -> None:
    """Raise ConfigurationError if the instrument would reject a setpoint."""
    _check_range(BY_NAME["setpoint_requested"], "setpoint_kpa", "kPa", setpoint_kpa, 1.0)


def check_force_limit(force_limit_n: float) -> None:
    """Raise ConfigurationError if the instrument would reject a force limit."""
    _check_range(BY_NAME["force_limit"], "force_limit_n", "N", force_limit_n, 1.0)


def check_lease(lease_s: float) -> None:
    """Raise ConfigurationError if the instrument would reject a lease time."""
    _check_range(BY_NAME["lease"], "lease_s", "s", lease_s, 1e-3)


def check_bool(name: str, value: object) -> None:
    """Raise ConfigurationError if the value of an argument is not True or False."""
    if not isinstance(value, bool):
        raise ConfigurationError(f"{name} = {value!r} is invalid: it must be True or False")


def check_timeout(timeout_s: float) -> None:
    """Raise ConfigurationError if a timeout is not above 0 s."""
    if not (is_number(timeout_s) and timeout_s > 0):
        raise ConfigurationError(f"timeout_s = {timeout_s!r} is invalid: it must be above 0 s")


def check_longest_wait(timeout_s: float) -> None:
    """Raise ConfigurationError if the longest wait for a condition is below 0 s."""
    if not (is_number(timeout_s) and timeout_s >= 0):
        raise ConfigurationError(f"timeout_s = {timeout_s!r} is invalid: it must be 0 s or more")


def _check_range(register: Field, name: str, unit: str, value: float, unit_per_wire: float) -> None:
    """Raise ConfigurationError if the instrument would reject a value."""
    assert register.low is not None
    assert register.high is not None
    low, high = register.low * unit_per_wire, register.high * unit_per_wire
    if not (is_number(value) and low <= value <= high):
        raise ConfigurationError(
            f"{name} = {value!r} is invalid: it must be {low:g} to {high:g} {unit}; nothing was sent"
        )


def is_number(value: object) -> bool:
    """Return True for an integer or a float, also of numpy. Python does not check the types of a caller."""
    return isinstance(value, Real) and not isinstance(value, bool)
