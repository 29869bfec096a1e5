"""Exception for a rejected request, with the remedy of the fault catalogue."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from pneuforce.client.connection import SensorConnection
from pneuforce.client.details import LatchedFault, fault_of
from pneuforce.errors import Rejected
from pneuforce.registers.advice import REJECT_REASON_ADVICE

COMMAND_PREFIX = "the Command "  #: begin of the name of a request over CAN

#: Remedies for rejections that have no reject reason: Modbus exceptions and results of a CAN Command.
_OTHER_REMEDIES: Mapping[str, str] = {
    "illegal function": "The interface is read-only, or the role in this certificate does not allow the "
    "write. A vent alone is always allowed.",
    "illegal value": "A value is outside its range: see docs/registers.md for the range.",
    "out_of_range": "A value is outside its range: see docs/registers.md for the range.",
    "sequence_reused": "Another node sends Commands with the same sequence number: stop this node.",
}
#: Remedies for the reject reason "state" of a command: the general remedy would inflate the balloon.
_COMMAND_REMEDIES: Mapping[str, str] = {
    "zero_pressure": "The rig is not vented, or its pressure is not steady within ±1.3 kPa. If the rig has "
    "tripped, clear the faults. Vent, wait 1 s, and repeat the request.",
    "new_balloon": "The rig is not vented. Vent, wait until the rig is vented, and repeat the request.",
}
#: Reject reasons whose remedy depends on the first-out fault.
_CAUSED_BY_FAULT = ("fault_latched", "cause_persists", "link_lost")
_UNKNOWN = "The instrument gives no advice: see docs/faults.md."


def rejected(request: str, reason: str) -> Rejected:
    """Return the exception for a request that the instrument rejected for this reason."""
    remedy = _COMMAND_REMEDIES.get(request.removeprefix(COMMAND_PREFIX)) if reason == "state" else None
    remedy = remedy or REJECT_REASON_ADVICE.get(reason) or _OTHER_REMEDIES.get(reason, _UNKNOWN)
    return Rejected(request, reason, remedy)


def with_fault(error: Rejected, fault: LatchedFault | None) -> Rejected:
    """Return a rejection with the first-out fault, if a latched fault is its cause and is known."""
    if fault is None or error.fault or error.reason not in _CAUSED_BY_FAULT:
        return error
    remedy = f"{error.remedy} First-out fault {fault.name}: {fault.cause} {fault.remedy}"
    return Rejected(error.request, error.reason, remedy, fault.name)


@contextmanager
def fault_in_rejection(connection: SensorConnection) -> Iterator[None]:
    """Raise a rejection with the first-out fault of the instrument, if a latched fault is its cause."""
    try:
        yield
    except Rejected as error:
        raise with_fault(error, fault_of(connection.first_out_fault())) from None
