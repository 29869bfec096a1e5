"""Reasons for the rejection of a write: the names that the register `reject_reason` reports."""

from __future__ import annotations

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
