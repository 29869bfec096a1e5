"""Conditions of a running instrument, and waiting for them."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any

from pneuforce.client.failed_vent import failed_vent
from pneuforce.errors import PneuforceError
from pneuforce.instrument.core.faults import name_of
from pneuforce.registers.modbus.client import ModbusClient

POLL_S = 0.02
Values = dict[str, Any]


class WaitTimeout(PneuforceError, TimeoutError):
    """Error for a condition that did not become true in time."""


class RigTripped(PneuforceError):
    """Error for a rig that has tripped and cannot be inflated."""


def poll(
    read: Callable[[], Values],
    condition: Callable[[Values], bool],
    timeout_s: float,
    describe: Callable[[Values], str],
) -> Values:
    """Read values until the condition is true, and return these values.

    Raises WaitTimeout with a description of the last values if the condition is not true in time.
    """
    until_s = time.monotonic() + timeout_s
    while not condition(values := read()):
        if time.monotonic() > until_s:
            raise WaitTimeout(
                f"the expected condition was not reached in {timeout_s:g} s: {describe(values)}"
            )
        time.sleep(POLL_S)
    return values


def vented(registers: Mapping[str, Any]) -> bool:
    """Return True if the vent is verified. Raises VentFailed if the instrument reports a failed vent."""
    if "vent_fault" in registers["status"]:
        raise failed_vent(registers["first_out_fault"], registers["pressure"])
    return "vented" in registers["status"]


def vented_and_zeroed(registers: Mapping[str, Any]) -> bool:
    """Return True if the vent is verified and the pressure sensor is zeroed."""
    return "vented" in registers["status"] and "not_zeroed" not in registers["status"]


def read_untripped(plc: ModbusClient) -> Values:
    """Return all registers. Raises RigTripped if the rig has tripped."""
    registers = plc.read_all()
    check_untripped(registers)
    return registers


def check_untripped(registers: Mapping[str, Any], hint: str = "") -> None:
    """Raise RigTripped, with the fault, if the rig has tripped. `hint` ends the message."""
    if registers["state"] == "tripped":
        raise RigTripped(
            f"the rig has tripped: {_describe_fault(registers)}; remove the cause and clear the fault{hint}"
        )


def _describe_fault(registers: Mapping[str, Any]) -> str:
    code = registers["first_out_fault"]
    return f"{name_of(code)} (fault {code})" if code else "no fault"


def describe(registers: Mapping[str, Any]) -> str:
    """Return the state, the pressure, the force, the status and the fault as a text for messages."""
    return (
        f"state {registers['state']}, pressure {registers['pressure']:.3f} kPa, "
        f"setpoint {registers['setpoint']:.3f} kPa, force {registers['force']:.3f} N, "
        f"status {' '.join(sorted(registers['status'])) or 'none'}, "
        f"reject reason {registers['reject_reason']}, {_describe_fault(registers)}"
    )
