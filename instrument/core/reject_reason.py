"""Reasons for the rejection of a write: the names that the register `reject_reason` reports, and remedies."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum, auto


class RejectReason(StrEnum):
    """Reason for the rejection of a write. An accepted write has the reason NONE."""

    NONE = auto()
    STATE = auto()  #: not allowed in this state or in this order
    FAULT_LATCHED = auto()  #: a fault is latched: clear the faults first
    LEASE = auto()  #: another peer holds the lease, or a lease is required
    WRITE_PROTECT = auto()  #: the configuration rejects every write except a vent
    CAUSE_PERSISTS = auto()  #: the cause of the fault still exists
    LINK_LOST = auto()  #: no samples arrive from the rig
    NOT_ZEROED = auto()  #: the zero adjustment of the pressure sensor is missing
    IN_CONTACT = auto()  #: not allowed during a contact
    IMPLAUSIBLE = auto()  #: the written value contradicts the configuration or the value before
    UNKNOWN_FIRMWARE = auto()  #: the firmware is not a released firmware, and the configuration requires it


#: Cause and remedy of each reason, for the line of the log.
REMEDIES: Mapping[RejectReason, str] = {
    RejectReason.STATE: "not allowed in this state or order, or a command is running: wait until the command "
    "has ended, then write mode vent, a setpoint and mode hold; write a reference pressure only while vented",
    RejectReason.FAULT_LATCHED: "a fault is latched: remove its cause, clear the faults, and write mode vent",
    RejectReason.LEASE: "another peer holds the lease, or the configuration requires a lease: wait until the "
    "lease is free, and write a lease",
    RejectReason.WRITE_PROTECT: "the configuration allows no write except a vent: set write_protect = false",
    RejectReason.CAUSE_PERSISTS: "the cause of the fault still exists: remove the cause",
    RejectReason.LINK_LOST: "no samples arrive from the rig: check its cable and its power supply",
    RejectReason.NOT_ZEROED: "the pressure sensor has no zero adjustment: vent, and wait for the zero",
    RejectReason.IN_CONTACT: "not allowed during a contact: end the contact, and wait",
    RejectReason.IMPLAUSIBLE: "the ambient pressure contradicts the configuration or the value before: "
    "check the barometer and circuit.ambient_kpa",
    RejectReason.UNKNOWN_FIRMWARE: "the firmware of the board is not a released firmware, which "
    "rig.require_released_firmware demands: install the firmware of this package with pneuforce flash",
}
