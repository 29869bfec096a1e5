"""The commands that send one request to an instrument: set, release, clear, zero, new-balloon."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from typing import Any

from pneuforce.client.address import connect
from pneuforce.client.details import LatchedFault
from pneuforce.client.measurement import State, Status
from pneuforce.client.sensor import ForceSensor
from pneuforce.errors import Rejected
from pneuforce.instrument.cli.operate.instrument_address import command
from pneuforce.instrument.cli.terminal.output import pressure_text, print_done, print_text
from pneuforce.instrument.model.balloon import VALID_HIGH_KPA, VALID_LOW_KPA

INFLATED = (State.INFLATING, State.SETTLING, State.HOLDING)
#: Reject reasons whose remedy depends on the first-out fault.
_CAUSED_BY_FAULT = ("fault_latched", "cause_persists")


class RejectedByFault(Rejected):
    """Request that the instrument rejected because of a fault. `fault` is the name of the first-out fault."""

    def __init__(self, error: Rejected, fault: LatchedFault) -> None:
        remedy = f"{error.remedy} First-out fault {fault.name}: {fault.cause} {fault.remedy}"
        super().__init__(error.request, error.reason, remedy)
        self.fault = fault.name


def execute(url: str, request: Callable[[ForceSensor], str], as_json: bool, **values: Any) -> None:
    """Connect, send a request, and print the sentence that it returns. Raises ClientError if it fails.

    With `as_json`, the result also contains `values`.
    """
    with connect(url) as sensor:
        message = explained(sensor, request)
    print_done(message, as_json, **values)


def set_setpoint(url: str, setpoint_kpa: float, as_json: bool) -> None:
    """Write the setpoint. Warn of a setpoint without a force. Raises ClientError if it fails."""
    warning = show_warning(setpoint_kpa, as_json)
    execute(url, lambda sensor: write_setpoint(sensor, setpoint_kpa), as_json, warning=warning)


def show_warning(setpoint_kpa: float, as_json: bool) -> str | None:
    """Return a warning if no force is measured at a setpoint, and print the warning unless `as_json`."""
    if VALID_LOW_KPA <= setpoint_kpa <= VALID_HIGH_KPA:
        return None
    valid = f"{VALID_LOW_KPA:g} to {VALID_HIGH_KPA:g} kPa"
    warning = f"no force is measured at a setpoint of {setpoint_kpa:g} kPa, but only from {valid}"
    if not as_json:
        print_text(f"pneuforce: warning: {warning}", sys.stderr)
    return warning


def explained(sensor: ForceSensor, request: Callable[[ForceSensor], str]) -> str:
    """Return the result of a request. A rejection because of a fault also describes the fault."""
    try:
        return request(sensor)
    except Rejected as error:
        fault = sensor.details().first_out_fault if error.reason in _CAUSED_BY_FAULT else None
        if fault is None:
            raise
        raise RejectedByFault(error, fault) from None


def write_setpoint(sensor: ForceSensor, setpoint_kpa: float) -> str:
    """Write the setpoint, and return when it takes effect."""
    sensor.set_setpoint(setpoint_kpa)
    measurement = sensor.read()
    stored = f"The setpoint {setpoint_kpa:g} kPa is stored for the next hold."
    if measurement.state is State.TRIPPED:
        return f"{stored} The rig has tripped, and a hold is rejected until the faults are cleared."
    if measurement.state not in INFLATED:
        return f"{stored} To inflate: {command('hold', sensor.url)}"
    when = "after the contact" if Status.IN_CONTACT in measurement.status else "now"
    return f"The setpoint {setpoint_kpa:g} kPa takes effect {when}."


def release_lease(sensor: ForceSensor) -> str:
    """Vent, end the lease, and wait for the confirmation of the vent.

    Raises Rejected, after the vent, if another peer has the lease.
    """
    try:
        sensor.release()
    except Rejected as error:
        holder = sensor.details().lease_holder or "unknown"
        raise Rejected(
            "The balloon was vented, but the end of the lease",
            error.reason,
            f"The lease belongs to another peer, a client of {holder}. End its program.",
        ) from None
    return f"The lease has ended. {confirmed_vent(sensor)}"


def set_force_limit(sensor: ForceSensor, force_limit_n: float) -> str:
    """Write the limit of the force alarm."""
    sensor.set_force_limit(force_limit_n)
    return (
        f"The limit of the force alarm is {force_limit_n:g} N until the next start of the instrument, which "
        "uses force_limit_n of its configuration."
    )


def confirmed_vent(sensor: ForceSensor) -> str:
    """Wait for the confirmation of a vent, and return it as a sentence. Raises VentNotConfirmed."""
    return vented_text(sensor.wait_until_vented().pressure_kpa)


def vented_text(pressure_kpa: float | None) -> str:
    """Return the message about a confirmed vent. The sensor is on the board, and does not see the balloon."""
    return f"Vented: the sensor reads {pressure_text(pressure_kpa)}. Look at the balloon."


def clear_and_report(url: str, as_json: bool) -> None:
    """Clear the faults, and print which faults were latched before. Raises ClientError if this fails."""
    with connect(url) as sensor:
        cleared = [fault.name for fault in sensor.details().latched_faults]
        message = explained(sensor, lambda sensor: _clear(sensor, cleared))
    print_done(message, as_json, cleared=cleared)


def _clear(sensor: ForceSensor, cleared: Sequence[str]) -> str:
    """Clear the faults, whose names are `cleared`."""
    sensor.clear()
    result = f"Cleared: {', '.join(cleared)}" if cleared else "No fault was latched, so nothing was cleared"
    inflate = command("hold", sensor.url)
    return f"{result}. No valve was moved. Look at the balloon before you inflate it: {inflate}"


def make_zero_adjustment(sensor: ForceSensor) -> str:
    """Make a zero adjustment."""
    sensor.zero()
    return "The zero adjustment is done."


def mount_balloon(sensor: ForceSensor, balloon_id: int) -> str:
    """Store that another balloon was mounted."""
    sensor.new_balloon(balloon_id)
    return (
        f"The balloon {balloon_id} is mounted, and its inflations are counted from 0. Also write its number "
        "into the configuration (balloon.id), which the next start uses."
    )
