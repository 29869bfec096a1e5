"""Why a request was refused: the names that the refusal register knows."""

from __future__ import annotations

from enum import StrEnum, auto


class Refusal(StrEnum):
    """NONE where it was accepted."""

    NONE = auto()
    STATE = auto()  #: not in this state, or not in this order
    FAULT_LATCHED = auto()  #: tripped: clear the faults first
    LEASE = auto()  #: another peer holds the lease, or a lease is demanded
    WRITE_LOCK = auto()
    CAUSE_PERSISTS = auto()  #: the fault's cause is not gone
    LINK_LOST = auto()
    NOT_ZEROED = auto()
    IN_CONTACT = auto()
