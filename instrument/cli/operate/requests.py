"""The commands that send one request to an instrument: set, release, clear, zero, new-balloon."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from typing import Any

from pneuforce.client.address import connect
from pneuforce.client.details import VENT_FAULTS, Details
from pneuforce.client.failed_vent import TUBE_UNPROVEN
from pneuforce.client.measurement import INFLATED, State, Status
from pneuforce.client.rejection import with_fault
from pneuforce.client.sensor import ForceSensor
from pneuforce.errors import Rejected
from pneuforce.instrument.cli.operate.confirmed_vent import confirmed_vent
from pneuforce.instrument.cli.operate.instrument_address import command
from pneuforce.instrument.cli.terminal.output import print_done, print_text
from pneuforce.instrument.model.balloon import VALID_HIGH_KPA, VALID_LOW_KPA

#: Warning after the fault of a vent was cleared.
DOUBTFUL = (
    "THE BALLOON MAY STILL BE INFLATED, although the sensor reads no pressure: do not pull the balloon out. "
)


class RejectedByLease(Rejected):
    """Request that the instrument rejected because of a lease. `holder` is the bus of its holder, or None."""

    def __init__(self, request: str, holder: str | None) -> None:
        remedy = "The configuration requires a lease (lease_required), and this request has none."
        if holder is not None:
            remedy = f"A client of {holder} holds the lease: end its program, or wait until its lease ends."
        super().__init__(request, "lease", remedy)


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
    """Return the result of a request. A rejection names its cause: the latched fault, or the lease."""
    try:
        return request(sensor)
    except Rejected as error:
        raise _with_cause(error, sensor.details()) from None


def _with_cause(error: Rejected, details: Details) -> Rejected:
    """Return the rejection with its cause, if `details` contains the cause."""
    if error.reason == "lease" and not isinstance(error, RejectedByLease):
        return RejectedByLease(error.request, _lease_holder(details))
    return with_fault(error, details.first_out_fault)


def _lease_holder(details: Details) -> str | None:
    return details.lease_holder if details.lease_left_s is not None else None


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

    Raises VentNotConfirmed. Raises Rejected, after the confirmation, if another peer has the lease.
    """
    try:
        sensor.release()
    except Rejected:
        holder = _lease_holder(sensor.details())  # before the wait, because the vent can end the lease
        raise RejectedByLease(f"{confirmed_vent(sensor)} The end of the lease", holder) from None
    return f"This computer has no lease now. {confirmed_vent(sensor)}"


def set_force_limit(sensor: ForceSensor, force_limit_n: float) -> str:
    """Write the limit of the force alarm."""
    sensor.set_force_limit(force_limit_n)
    return (
        f"The limit of the force alarm is {force_limit_n:g} N until the next start of the instrument, which "
        "uses force_limit_n of its configuration."
    )


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
    if not cleared and sensor.read().state in INFLATED:
        return f"{result}. No valve was moved. The balloon is inflated"
    maintenance = sensor.details().maintenance_causes or ()
    warning = DOUBTFUL if VENT_FAULTS.intersection(cleared) or TUBE_UNPROVEN in maintenance else ""
    inflate = command("hold", sensor.url)
    return f"{result}. No valve was moved. {warning}Look at the balloon before you inflate it: {inflate}"


def make_zero_adjustment(sensor: ForceSensor) -> str:
    """Make a zero adjustment."""
    try:
        sensor.zero()
    except Rejected as error:
        if error.reason != "in_contact":
            raise
        remedy = (
            f"{error.remedy} Then vent, because only a vented rig has a zero: {command('vent', sensor.url)}"
        )
        raise Rejected(error.request, error.reason, remedy) from None
    return "The zero adjustment is done."


def mount_balloon(sensor: ForceSensor, balloon_id: int) -> str:
    """Store that another balloon was mounted."""
    sensor.new_balloon(balloon_id)
    return (
        f"The balloon {balloon_id} is mounted, and its inflations are counted from 0. Also write its number "
        "into the configuration (balloon.id), which the next start uses."
    )
